// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/dynamic_objects/optical_flow.hpp"
#include "roslam/estimation/pose_optimiser.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"

namespace roslam {

/// Points tracked from an earlier frame; pixels of the current image as taken (distorted).
struct TrackedPoints {
  std::vector<cv::Point2f> at_rest;
  std::vector<cv::Point2f> moving;
  double sigma = 0.0;  ///< pixels; residual of static points (blur, pose error, rolling shutter)
};

/// Sparse optical flow of a frame: the motion of the camera, and the points that do not move with the static
/// scene.
class FlowConsistency {
 public:
  FlowConsistency(const Camera& camera, const DynamicObjectOptions& options, const DepthOptions& depth,
                  const MeasurementNoise& noise, const PoseOptimiserOptions& pose)
      : camera_(camera), options_(options), depth_(depth), noise_(noise), pose_(pose) {}

  void set_depth_noise(const DepthNoise& noise) { noise_ = noise_.known_of({}, noise); }

  /// Tracks the corners of the last frame to the current one, whose pose is a prediction or unknown. Sets its
  /// corners, and returns its T_camera_world by those that were outside the mask; nothing if no pose is
  /// predicted or too few agree.
  std::optional<SE3> track(const PastFrame& last, PastFrame& current) const;

  /// Classifies the corners that a past frame and the current one have in common. One moves if it differs by
  /// more than the noise of pixels, depth and pose from its reprojection by its depth in the past frame, or,
  /// if that is unknown, from its epipolar line; if it then fails the forward-backward check it is dropped
  /// from the current frame. Empty if a pose is unknown.
  TrackedPoints follow(const PastFrame& past, PastFrame& current) const;

  /// The moving points with others nearby, since single ones may be outliers.
  std::vector<cv::Point2f> in_company(const TrackedPoints& followed) const;

  /// Where a static point of the past frame is predicted in the current one; the same pixel if a pose is
  /// unknown.
  cv::Point2f expected(const PastFrame& past, const PastFrame& current, const cv::Point2f& point) const;

 private:
  cv::Point2f expected(const PastFrame& past, const PastFrame& current, const cv::Point2f& point,
                       const Eigen::Vector2d& undistorted) const;
  std::optional<SE3> camera_pose(const PastFrame& last, const PastFrame& current) const;
  double residual(const Eigen::Vector2d& from, float depth, const Eigen::Vector2d& to,
                  const SE3& T_current_past, double pixel_sigma) const;
  bool is_covered(const Corner& from, float depth, const Corner& to, const cv::Mat& depth_image,
                  const SE3& T_current_past) const;

  Camera camera_;
  DynamicObjectOptions options_;
  DepthOptions depth_;
  MeasurementNoise noise_;
  PoseOptimiserOptions pose_;
};

}  // namespace roslam
