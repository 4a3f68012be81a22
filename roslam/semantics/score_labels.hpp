// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/semantics/segmenter.hpp"

namespace roslam {

/// Converts the network's scores (CV_32F, 1 x 19 x h x w, on a coarse grid over the image) to the labels and
/// confidences of an image of the given size: the class with the highest score after bilinear interpolation,
/// pixel centres aligned at half pixels. The result is exact, but between four grid points with the same best
/// class nothing is interpolated, since no other class can win there. seconds is left at 0.
Segmentation labels_from_scores(const cv::Mat& scores, const cv::Size& size);

}  // namespace roslam
