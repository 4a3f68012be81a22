// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/geometry/se3.hpp"

namespace roslam {

/// The data of a frame that later frames are compared with.
struct PastFrame {
  std::size_t index = 0;                   ///< in the source
  double timestamp = 0.0;                  ///< seconds
  std::vector<cv::Mat> pyramid;            ///< for cv::calcOpticalFlowPyrLK
  cv::Mat depth;                           ///< CV_32FC1 metres, 0 = unknown; may be empty
  std::optional<SE3> T_camera_world;       ///< by tracking; nothing if the pose is unknown
  std::vector<cv::Point2f> points;         ///< corners outside the mask, in the image as taken
  std::vector<cv::Point2f> moving_points;  ///< corners inside the mask
};

/// A point of one frame tracked to another; pixels of the images as taken.
struct FlowMatch {
  cv::Point2f from;
  cv::Point2f to;
};

/// The image pyramid for track_points. grey: CV_8UC1.
std::vector<cv::Mat> flow_pyramid(const cv::Mat& grey);

/// Tracks points from one pyramid to another (pyramidal Lucas-Kanade, Bouguet 2001). guess: where each is
/// predicted, or empty. Points that fail the forward-backward check are empty.
std::vector<std::optional<cv::Point2f>> track_points(const std::vector<cv::Mat>& from,
                                                     const std::vector<cv::Mat>& to,
                                                     const std::vector<cv::Point2f>& points,
                                                     const std::vector<cv::Point2f>& guess);

/// At most so many of the points, evenly spaced in their order.
std::vector<cv::Point2f> thinned(const std::vector<cv::Point2f>& points, std::size_t wanted);

}  // namespace roslam
