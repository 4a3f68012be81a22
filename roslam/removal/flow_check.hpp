// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/pose_optimiser.hpp"
#include "roslam/removal/optical_flow.hpp"
#include "roslam/removal/removal_options.hpp"

namespace roslam {

/// What became of the points of an earlier frame; pixels of the current image as taken.
struct FollowedPoints {
  std::vector<cv::Point2f> at_rest;
  std::vector<cv::Point2f> moving;
  double sigma = 0.0;  ///< pixels that points at rest are off by: blur, a bad pose, a rolling shutter
};

/// What sparse optical flow says about a frame: how the camera moved, and which points did not move with the
/// scene.
class FlowCheck {
 public:
  FlowCheck(const Camera& camera, const RemovalOptions& options, const DepthOptions& depth,
            const MeasurementNoise& noise, const PoseOptimiserOptions& pose)
      : camera_(camera), options_(options), depth_(depth), noise_(noise), pose_(pose) {}

  /// Pose of the current frame from the flow of the last frame's points at rest; nothing if too few agree.
  std::optional<SE3> camera_pose(const PastFrame& last, const PastFrame& current,
                                 const SE3& predicted_T_camera_world) const;

  /// Follows points of a past frame and tells those that move against the scene: their pixel differs from
  /// where a point at rest would be seen, by its depth in the past frame, or lies off its epipolar line where
  /// the depth is unknown, by more than the noise of pixels, depth and pose explains. None where a pose is
  /// not known.
  FollowedPoints follow(const PastFrame& past, const PastFrame& current) const;

  /// The moving points that are not alone: one point proves nothing, several near each other do.
  std::vector<cv::Point2f> in_company(const FollowedPoints& followed) const;

  /// Where a point at rest of the past frame is expected in the current one; the same place where a pose is
  /// not known.
  cv::Point2f expected(const PastFrame& past, const PastFrame& current, const cv::Point2f& point) const;

 private:
  double residual(const Eigen::Vector2d& from, float depth, const Eigen::Vector2d& to,
                  const SE3& T_current_past, double pixel_sigma) const;

  Camera camera_;
  RemovalOptions options_;
  DepthOptions depth_;
  MeasurementNoise noise_;
  PoseOptimiserOptions pose_;
};

}  // namespace roslam
