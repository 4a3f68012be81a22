// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace roslam {

inline constexpr int kSeamRim =
    12;  ///< pixels around a hole along which what is put in is compared with the picture

/// What is put into a hole, in the light of what is around it: along the rim, where both are known, they
/// should be equal; their difference there, spread smoothly over the hole, is added. picture: CV_8UC3 as
/// taken. paint: CV_8UC3 of the same size, known where known (CV_8UC1) is nonzero, in the hole and along its
/// rim. hole: CV_8UC1. Rim pixels that differ by more than light explains do not count. Returns the paint.
cv::Mat matched_to_rim(const cv::Mat& picture, const cv::Mat& paint, const cv::Mat& known,
                       const cv::Mat& hole);

}  // namespace roslam
