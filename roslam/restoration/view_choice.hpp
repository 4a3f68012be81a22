// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/restoration/view.hpp"
#include "roslam/restoration/view_link.hpp"

namespace roslam {

/// Points of the static scene that a hole may hide, in the target camera's frame: some hundred pixels of the
/// area, as deep as the farthest of what is known left, right, above and below of them. depth: CV_32FC1 of
/// the target, 0 where unknown or in the hole; may be empty.
std::vector<Eigen::Vector3f> hidden_points(const PixelRays& rays, const cv::Mat& area, const cv::Mat& depth);

/// At most so many links, those first that add most to what is seen of the points; none that shows nothing.
std::vector<ViewLink> best_links(const std::vector<ViewLink>& links,
                                 const std::vector<Eigen::Vector3f>& points, int count);

}  // namespace roslam
