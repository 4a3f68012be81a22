// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace roslam::telemetry {

/// A small JPEG of an image (CV_8UC3, BGR) for the page: what was removed tinted, points that were used as
/// dots, those that were removed as crosses (pixels of the image). mask: CV_8UC1 of its size, or empty.
std::string frame_jpeg(const cv::Mat& colour, const cv::Mat& mask, const std::vector<cv::Point2f>& points,
                       const std::vector<cv::Point2f>& removed_points);

}  // namespace roslam::telemetry
