// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// A corner that is tracked from frame to frame.
struct Corner {
  int track = 0;                ///< the same in each frame; ascending within a frame
  cv::Point2f pixel;            ///< in the image as taken
  Eigen::Vector2d undistorted;  ///< the pixel without lens distortion
  bool is_removed = false;      ///< inside the mask
};

/// The image pyramid that optical flow is computed on.
struct FlowPyramid {
  std::vector<cv::Mat> levels;  ///< for cv::calcOpticalFlowPyrLK
  cv::Size image;               ///< size of the image, pixels
  float scale = 1.0F;           ///< pixels of the image in one of the first level
  int window = 13;              ///< pixels of a level around a corner that are compared
};

/// The data of a frame that later frames are compared with.
struct PastFrame {
  std::size_t index = 0;   ///< in the source
  double timestamp = 0.0;  ///< seconds
  FlowPyramid pyramid;
  cv::Mat depth;                      ///< CV_32FC1 metres, 0 = unknown; may be empty
  std::optional<SE3> T_camera_world;  ///< by tracking; nothing if the pose is unknown
  std::vector<Corner> corners;        ///< those tracked from the frame before, and new ones
};

/// A corner that two frames show.
struct CornerMatch {
  const Corner* from;
  const Corner* to;
};

/// The corners that two frames have in common, which is optical flow over any number of frames.
std::vector<CornerMatch> common_corners(const PastFrame& from, const PastFrame& to);

/// grey: CV_8UC1.
FlowPyramid flow_pyramid(const cv::Mat& grey);

/// Tracks points from one pyramid to another (pyramidal Lucas-Kanade, Bouguet 2001). guess: where each is
/// predicted. Points that are lost are empty.
std::vector<std::optional<cv::Point2f>> track_points(const FlowPyramid& from, const FlowPyramid& to,
                                                     const std::vector<cv::Point2f>& points,
                                                     const std::vector<cv::Point2f>& guess);

/// Forward-backward check: how far from where it was each corner, tracked from one pyramid to another, is
/// tracked back to; pixels, infinite if it is lost.
std::vector<float> return_errors(const FlowPyramid& from, const FlowPyramid& to,
                                 const std::vector<CornerMatch>& matches);

/// Chooses the corners that are tracked from a frame on: one for each small block of the image.
class CornerSelection {
 public:
  explicit CornerSelection(const Camera& camera) : camera_(camera) {}

  /// Drops corners that came together, and adds some of the points (pixels, as taken) where there are none.
  /// is_removed: the points are inside the mask, where they lie more densely.
  void replenish(std::vector<Corner>& corners, const std::vector<cv::Point2f>& points, bool is_removed);

 private:
  Camera camera_;
  int last_track_ = 0;
};

}  // namespace roslam
