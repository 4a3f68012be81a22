// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/restoration/restoration_options.hpp"

namespace roslam {

/// Completes the depth of inpainted pixels with planes fitted around each hole (RANSAC) to the inverse depth,
/// which is linear in the image on a plane. From each cell of the hole 16 rays are cast in the image to the
/// surfaces around it; each pixel gets the nearest of the surfaces that enough rays hit, extrapolated to it.
/// Where the surroundings have no depth (sky), the hole gets none. depth: CV_32FC1 metres, 0 = unknown, also
/// in the hole. hole: CV_8UC1, nonzero where depth is wanted. Returns CV_32FC1 metres, 0 where unknown and
/// outside the hole.
cv::Mat completed_depth(const cv::Mat& depth, const cv::Mat& hole,
                        const DepthCompletionOptions& options = {});

}  // namespace roslam
