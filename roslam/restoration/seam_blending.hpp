// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace roslam {

inline constexpr int kSeamRim = 12;  ///< pixels around a hole where the fill is compared with the image

/// Seam blending: adds to the fill of a hole its difference from the image along the rim of the hole,
/// interpolated smoothly over the hole (pull-push pyramid). Rim pixels that differ by more than exposure
/// explains are ignored. image: CV_8UC3 as taken. fill: CV_8UC3 of the same size, valid where known (CV_8UC1)
/// is nonzero, in the hole and along its rim. hole: CV_8UC1. Returns the fill, CV_8UC3,
/// corrected in the hole.
cv::Mat matched_to_rim(const cv::Mat& image, const cv::Mat& fill, const cv::Mat& known, const cv::Mat& hole);

}  // namespace roslam
