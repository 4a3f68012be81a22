// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "roslam/estimation/estimation_options.hpp"
#include "roslam/estimation/measurement_model.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// A known point and its measurement in the frame.
struct PoseMeasurement {
  Eigen::Vector3d point_world = Eigen::Vector3d::Zero();  ///< metres
  Measurement measurement;
  double weight = 1.0;  ///< factor of its information, 0 to 1
};

struct OptimisedPose {
  SE3 T_camera_world;
  std::vector<bool> is_inlier;  ///< one per measurement
  int inliers = 0;

  /// Standard deviation of the pixel errors of all measurements of full weight, inliers or not, in the sigmas
  /// assumed; by their median. 1 if the noise model is right; 0 if there is no pose.
  double pixel_error_scale = 0.0;

  /// Of the pose, perturbed from the left: T = exp(x) T_camera_world with x = (translation m, rotation rad)
  /// in the camera frame. By the inliers with their weights and the scale of their errors, as if landmarks
  /// were exact; zero if there is no pose.
  Matrix6d covariance = Matrix6d::Zero();
};

/// The camera pose that fits the measurements best: Gauss-Newton on reprojection and inverse depth errors
/// with Huber weights. After each round, measurements above outlier_limit are excluded; they may become
/// inliers again later. With fewer than three inliers the initial pose is returned, without inliers.
OptimisedPose optimise_pose(const Camera& camera, const std::vector<PoseMeasurement>& measurements,
                            const SE3& initial_T_camera_world, const PoseOptimiserOptions& options = {});

}  // namespace roslam
