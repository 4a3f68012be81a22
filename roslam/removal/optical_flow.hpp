// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/geometry/se3.hpp"

namespace roslam {

/// A frame as later frames look back at it.
struct PastFrame {
  std::size_t index = 0;                   ///< in the source
  double timestamp = 0.0;                  ///< seconds
  std::vector<cv::Mat> pyramid;            ///< for cv::calcOpticalFlowPyrLK
  cv::Mat depth;                           ///< CV_32FC1 metres, 0 = unknown; may be empty
  std::optional<SE3> T_camera_world;       ///< as tracking left it; nothing while the pose is not known
  std::vector<cv::Point2f> points;         ///< corners on what seemed to be at rest, in the image as taken
  std::vector<cv::Point2f> moving_points;  ///< corners on what was removed
};

/// A point of one frame found again in another; pixels of the images as taken.
struct FlowMatch {
  cv::Point2f from;
  cv::Point2f to;
};

/// The image pyramid that track_points wants.
std::vector<cv::Mat> flow_pyramid(const cv::Mat& grey);

/// Follows points from one pyramid to another (Lucas and Kanade, Bouguet 2001). guess: where each is
/// expected, or empty. What cannot be followed there and back again is nothing.
std::vector<std::optional<cv::Point2f>> track_points(const std::vector<cv::Mat>& from,
                                                     const std::vector<cv::Mat>& to,
                                                     const std::vector<cv::Point2f>& points,
                                                     const std::vector<cv::Point2f>& guess);

/// At most so many of the points, evenly over their order.
std::vector<cv::Point2f> thinned(const std::vector<cv::Point2f>& points, std::size_t wanted);

}  // namespace roslam
