// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/restoration/source_image.hpp"
#include "roslam/restoration/source_warp.hpp"

namespace roslam {

/// Points of the static scene that a hole may hide (target camera frame, metres): about 150 pixels of the
/// area, each at the farthest of the known depths left, right, above and below it. depth: CV_32FC1 metres of
/// the target, 0 where unknown or in the hole; may be empty.
std::vector<Eigen::Vector3f> hidden_points(const PixelRays& rays, const cv::Mat& area, const cv::Mat& depth);

/// Greedy view selection: at most count warps, each the one that adds most to the visibility of the points;
/// none that shows no point.
std::vector<SourceWarp> select_sources(const std::vector<SourceWarp>& warps,
                                       const std::vector<Eigen::Vector3f>& points, int count);

}  // namespace roslam
