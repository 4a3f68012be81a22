// SPDX-License-Identifier: BSD-3-Clause
// Hash of what a network outputs for a generated input: the same on every processor. Needs the own engine
// alone, so that it can be compiled for other processors without their OpenCV.
#pragma once

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "roslam/inference/network_runner.hpp"
#include "roslam/inference/plan/onnx_graph.hpp"

namespace roslam {

inline std::string file_content(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Those of this processor, the fastest first.
inline std::vector<const Kernels*> runnable_kernels() {
  std::vector<const Kernels*> all;
  const Kernels* best = best_kernels();
  if (best == nullptr) return all;
  all.push_back(best);
  if (best == avx512_kernels() && avx2_kernels() != nullptr) all.push_back(avx2_kernels());
  return all;
}

/// Numbers from 0 to 1 in a fixed sequence; from channel 3 on (hole and square of the restorer) 0 or 1.
inline void fill_input(const TensorView& input) {
  std::uint32_t state = 12345;
  for (int y = 0; y < input.rows; ++y) {
    for (int x = 0; x < input.columns; ++x) {
      for (int c = 0; c < input.channels; ++c) {
        state = state * 1664525U + 1013904223U;
        const float number = static_cast<float>(state >> 8U) / 16777216.0F;
        const int border = 10 * (5 - c);
        const bool is_inside = y > border && x > border && y < 100 && x < 120;
        input.at(y, x)[c] = c < 3 ? number : is_inside ? 1.0F : 0.0F;
      }
    }
  }
}

/// FNV-1a over the bits of the output.
inline std::uint64_t output_hash(NetworkRunner& runner, int rows, int columns) {
  runner.prepare(rows, columns);
  fill_input(runner.input());
  const NetworkOutput output = runner.run();
  std::uint64_t hash = 14695981039346656037ULL;
  for (int y = 0; y < output.rows(); ++y) {
    for (int x = 0; x < output.columns(); ++x) {
      for (int c = 0; c < output.channels; ++c) {
        std::uint32_t bits = 0;
        std::memcpy(&bits, output.at(y, x) + c, sizeof(bits));
        for (int byte = 0; byte < 4; ++byte) hash = (hash ^ (bits >> (8 * byte) & 0xFFU)) * 1099511628211ULL;
      }
    }
  }
  return hash;
}

inline std::uint64_t network_hash(const std::string& model, const Kernels& kernels, int rows, int columns,
                                  int threads = 1) {
  NetworkRunner runner(plan_network(read_onnx(file_content(model))), kernels, threads);
  return output_hash(runner, rows, columns);
}

}  // namespace roslam
