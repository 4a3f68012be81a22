// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace roslam {

/// cv::dilate() of a mask (CV_8UC1) with an elliptic structuring element of an odd side (pixels). Much faster
/// for large elements, because whole runs of pixels are dilated. The result is 0 or 255.
cv::Mat dilated_by_disc(const cv::Mat& mask, int side);

}  // namespace roslam
