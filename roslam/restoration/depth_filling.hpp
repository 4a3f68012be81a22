// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace roslam {

/// Fills unknown depth by colour-guided propagation: of the nearest known depths to the left, right, above
/// and below, the one of the most similar colour. Thus the black screen of a monitor gets the depth of its
/// frame, the occlusion shadow beside a chair that of the wall. Accurate enough for occlusion tests, not for
/// mapping. depth: CV_32FC1, metres, 0 = unknown; colour: CV_8UC3 of the same size. The result is 0 only
/// where no depth is known in any of the four directions.
cv::Mat filled_depth(const cv::Mat& depth, const cv::Mat& colour);

}  // namespace roslam
