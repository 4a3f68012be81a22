// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// A known point and where the frame shows it.
struct PoseMeasurement {
  Eigen::Vector3d point_world = Eigen::Vector3d::Zero();  ///< metres
  Measurement measurement;
};

struct PoseOptimiserOptions {
  int rounds = 4;      ///< each decides anew which measurements are outliers
  int iterations = 8;  ///< Gauss-Newton steps a round, at most

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct OptimisedPose {
  SE3 T_camera_world;
  std::vector<bool> is_inlier;  ///< one a measurement
  int inliers = 0;
};

/// The camera pose that fits the measurements best: Gauss-Newton on the reprojection and depth errors with
/// Huber weights; outliers by the chi-squared test are set aside and may come back. With fewer than three
/// measurements the initial pose is returned without inliers.
OptimisedPose optimise_pose(const Camera& camera, const std::vector<PoseMeasurement>& measurements,
                            const SE3& initial_T_camera_world, const PoseOptimiserOptions& options = {});

}  // namespace roslam
