// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace roslam {

/// A tensor in memory: rows x columns pixels of channels.
struct TensorView {
  float* data = nullptr;  ///< of the first pixel; a border of zeros may lie around it
  int rows = 0;
  int columns = 0;
  int channels = 0;
  std::ptrdiff_t pixel_step = 0;
  std::ptrdiff_t row_step = 0;

  float* at(int row, int column) const { return data + row * row_step + column * pixel_step; }
};

/// The output of a network, valid until its next run.
struct NetworkOutput {
  TensorView tensor;
  int sub_pixels = 1;  ///< as in NetworkPlan
  int lanes = 0;
  int channels = 0;

  int rows() const { return tensor.rows * sub_pixels; }
  int columns() const { return tensor.columns * sub_pixels; }

  /// The channels of one pixel.
  const float* at(int row, int column) const {
    return tensor.at(row / sub_pixels, column / sub_pixels) +
           static_cast<std::ptrdiff_t>(row % sub_pixels * sub_pixels + column % sub_pixels) * lanes;
  }
};

}  // namespace roslam
