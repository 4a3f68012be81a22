// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "roslam/inference/kernels.hpp"
#include "roslam/inference/plan/network_plan.hpp"
#include "roslam/inference/row_team.hpp"
#include "roslam/inference/tensor_view.hpp"

namespace roslam {

/// 32-bit floats aligned to cache lines, zero at first.
class FloatBuffer {
 public:
  FloatBuffer() = default;
  explicit FloatBuffer(std::size_t size);
  float* data() const { return data_.get(); }

 private:
  struct Free {
    void operator()(float* data) const;
  };
  std::unique_ptr<float, Free> data_;
};

/// A step with weights packed for the kernels.
struct PackedStep {
  PlannedStep plan;
  FloatBuffer weights;
  FloatBuffer bias;
  FloatBuffer depthwise_weights;
  FloatBuffer depthwise_bias;
};

/// Runs a planned network on NHWC tensors with the kernels of one instruction set. The result is the same,
/// bit by bit, for all instruction sets and numbers of threads. Not thread safe.
class NetworkRunner {
 public:
  /// threads: 1 or more.
  NetworkRunner(NetworkPlan plan, const Kernels& kernels, int threads);

  int input_channels() const { return plan_.tensors[0].channels; }

  /// Makes the buffers for an input of that size; nothing is done if it is the last one's. Throws ModelError
  /// if the network does not work at that size, std::bad_alloc.
  void prepare(int rows, int columns);

  /// Takes the input of the next run: one plane for each channel, not normalised.
  void set_input(const float* planes);

  /// Where the input is written by who normalises it: (x - mean) / deviation.
  TensorView input() const { return views_[0]; }
  float mean(int channel) const;
  float deviation(int channel) const;

  NetworkOutput run();

  /// Of the convolutions, at the size prepared.
  double multiply_adds() const;

  const Kernels& kernels() const { return kernels_; }

 private:
  struct Size {
    int rows = 0;
    int columns = 0;
  };
  struct Memory {
    FloatBuffer buffer;
    std::array<int, 4> key;  // rows, columns, channels, border
    int free_after = -1;     // step
  };

  void pack(PlannedStep step);
  std::vector<Size> sizes_for(int rows, int columns) const;
  Size size_after(const PlannedStep& step, const std::vector<Size>& sizes) const;
  int root_of(int tensor) const;
  std::vector<int> last_uses() const;
  void place(int root, const Size& size, int first_use, int last_use);
  void allocate(const std::vector<Size>& sizes);
  std::ptrdiff_t scratch_needed() const;
  void run_step(const PackedStep& step);
  void run_rows(const PackedStep& step, int begin, int end, int thread) const;
  void convolve(const PackedStep& step, int begin, int end, float* scratch) const;
  void convolve_single(const PackedStep& step, int begin, int end) const;
  const float* upsampled_row(const TensorView& from, int row, float* scratch, float* out,
                             std::ptrdiff_t out_step) const;
  void upsample(const PackedStep& step, int begin, int end, float* scratch) const;
  void combine(const PackedStep& step, int begin, int end) const;
  void average(const PackedStep& step, int begin, int end, float* scratch) const;
  void average_all(const PackedStep& step);
  void maximum(const PackedStep& step, int begin, int end) const;
  void normalise_regions(const PackedStep& step);
  void region_row(const PackedStep& step, int row, RegionRow& kernel_row) const;
  void depth_to_space(const PackedStep& step, int begin, int end) const;
  void copy(const PackedStep& step, int begin, int end) const;
  void sigmoid(const PackedStep& step, int begin, int end) const;
  const TensorView& view(int tensor) const { return views_[static_cast<std::size_t>(tensor)]; }
  std::ptrdiff_t padded(int channels) const;

  NetworkPlan plan_;
  const Kernels& kernels_;
  std::vector<PackedStep> steps_;
  std::vector<TensorView> views_;
  std::vector<Memory> memory_;
  std::vector<FloatBuffer> scratch_;  // one for each thread
  FloatBuffer region_sums_;
  std::size_t floats_ = 0;  // of the memory
  RowTeam team_;
};

}  // namespace roslam
