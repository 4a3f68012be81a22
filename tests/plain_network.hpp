// SPDX-License-Identifier: BSD-3-Clause
// The steps of a network in double precision, written as their definitions are.
#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "roslam/inference/plan/network_plan.hpp"

namespace roslam {

// An image of doubles with zeros around it.
struct Plain {
  int rows = 0;
  int columns = 0;
  int channels = 0;
  std::vector<double> values;

  Plain(int r, int c, int n)
      : rows(r), columns(c), channels(n), values(static_cast<std::size_t>(r * c * n)) {}
  double& at(int y, int x, int c) {
    return values[static_cast<std::size_t>((y * columns + x) * channels + c)];
  }
  double get(int y, int x, int c) const {
    if (y < 0 || x < 0 || y >= rows || x >= columns) return 0.0;
    return values[static_cast<std::size_t>((y * columns + x) * channels + c)];
  }
};

class Numbers {
 public:
  float next() { return distribution_(generator_); }
  std::vector<float> list(int count) {
    std::vector<float> all;
    for (int i = 0; i < count; ++i) all.push_back(next());
    return all;
  }
  Plain image(int rows, int columns, int channels) {
    Plain made(rows, columns, channels);
    for (double& value : made.values) value = static_cast<double>(next());
    return made;
  }

 private:
  std::mt19937 generator_{7};
  std::uniform_real_distribution<float> distribution_{-1.0F, 1.0F};
};

inline Plain convolved(const Plain& in, const PlannedStep& step) {
  const int outputs = static_cast<int>(step.bias.size());
  Plain out((in.rows - 1) / step.stride + 1, (in.columns - 1) / step.stride + 1, outputs);
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.columns; ++x) {
      for (int o = 0; o < outputs; ++o) {
        double sum = static_cast<double>(step.bias[static_cast<std::size_t>(o)]);
        for (int i = 0; i < in.channels; ++i) {
          for (int t = 0; t < step.kernel * step.kernel; ++t) {
            const auto w = static_cast<std::size_t>((o * in.channels + i) * step.kernel * step.kernel + t);
            sum += static_cast<double>(step.weights[w]) *
                   in.get(y * step.stride - step.padding + t / step.kernel * step.dilation,
                          x * step.stride - step.padding + t % step.kernel * step.dilation, i);
          }
        }
        out.at(y, x, o) = sum;
      }
    }
  }
  return out;
}

inline Plain depthwise(const Plain& in, const DepthwiseWeights& weights) {
  const int s = weights.stride;
  Plain out((in.rows - 1) / s + 1, (in.columns - 1) / s + 1, in.channels);
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.columns; ++x) {
      for (int c = 0; c < in.channels; ++c) {
        double sum = static_cast<double>(weights.bias[static_cast<std::size_t>(c)]);
        for (int t = 0; t < 9; ++t)
          sum += static_cast<double>(weights.weights[static_cast<std::size_t>(c * 9 + t)]) *
                 in.get(y * s - 1 + t / 3, x * s - 1 + t % 3, c);
        out.at(y, x, c) = sum;
      }
    }
  }
  return out;
}

inline Plain upsampled(const Plain& in) {
  Plain out(2 * in.rows, 2 * in.columns, in.channels);
  const auto source = [](int i, int size, int& first, int& second) {
    const double position = std::clamp((i + 0.5) / 2.0 - 0.5, 0.0, size - 1.0);
    first = static_cast<int>(position);
    second = std::min(first + 1, size - 1);
    return position - first;
  };
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.columns; ++x) {
      int y0, y1, x0, x1;
      const double down = source(y, in.rows, y0, y1);
      const double across = source(x, in.columns, x0, x1);
      for (int c = 0; c < in.channels; ++c)
        out.at(y, x, c) = (1 - down) * ((1 - across) * in.get(y0, x0, c) + across * in.get(y0, x1, c)) +
                          down * ((1 - across) * in.get(y1, x0, c) + across * in.get(y1, x1, c));
    }
  }
  return out;
}

}  // namespace roslam
