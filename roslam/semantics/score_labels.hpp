// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/inference/score_grid.hpp"
#include "roslam/semantics/segmenter.hpp"

namespace roslam {

/// Converts the network's scores of the 19 classes on a coarse grid over the image to the labels and
/// confidences of an image of the given size: the class with the highest score after bilinear interpolation,
/// pixel centres aligned at half pixels. The result is exact, but between four grid points with the same best
/// class nothing is interpolated, since no other class can win there. seconds is left at 0.
Segmentation labels_from_scores(const ScoreGrid& grid, const cv::Size& size);

}  // namespace roslam
