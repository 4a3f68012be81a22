// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace roslam {

/// Guesses the depth where it is unknown, from what is known to the left, right, above and below: of these
/// the one whose colour is most alike, so that the black screen of a monitor gets the depth of its frame and
/// the shadow beside a chair that of the wall. Good enough to tell what hides what, not to measure with.
/// depth: CV_32FC1, metres, 0 = unknown; colour: CV_8UC3 of the same size. The result is 0 only where a pixel
/// sees no known depth in any of the four directions.
cv::Mat filled_depth(const cv::Mat& depth, const cv::Mat& colour);

}  // namespace roslam
