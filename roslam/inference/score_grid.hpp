// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/inference/tensor_view.hpp"

namespace roslam {

/// Scores of the classes on a grid over an image. The scores are valid until the network's next run.
struct ScoreGrid {
  NetworkOutput scores;            ///< the classes of a point lie side by side
  std::vector<std::uint8_t> best;  ///< by point, row by row: the class with the highest score
  cv::Mat probability;             ///< CV_32FC1 of the grid: softmax probability of that class
  std::vector<float> memory;       ///< of the scores, if it is not the network's

  /// scores: CV_32F, 1 x classes x rows x columns.
  static ScoreGrid from_planes(const cv::Mat& scores);

  int rows() const { return scores.rows(); }
  int columns() const { return scores.columns(); }
  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns()) +
           static_cast<std::size_t>(column);
  }
};

}  // namespace roslam
