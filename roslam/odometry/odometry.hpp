// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "roslam/common/export.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// Where the body is and how it moves, for a controller. The frame odom is continuous: loop closures, bundle
/// adjustment and merged submaps change T_map_odom only (REP 105). Over long distances it drifts. Poses are
/// filtered, together with the velocities, without delay by design (MotionFilter).
struct ROSLAM_EXPORT Odometry {
  double timestamp = 0.0;  ///< seconds, of the image
  SE3 T_odom_body;         ///< body: x forward, y left, z up (Camera::T_body_camera)
  SE3 T_map_odom;          ///< map: the world frame of the submap that the pose is in
  Eigen::Vector3d linear_velocity = Eigen::Vector3d::Zero();   ///< of the body, in the body frame, m/s
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< in the body frame, rad/s

  /// Of T_odom_body: (position m, rotation vector rad) in odom, against its origin.
  Matrix6d covariance = Matrix6d::Zero();

  /// Of (linear velocity, angular velocity) in the body frame.
  Matrix6d velocity_covariance = Matrix6d::Zero();

  /// Of the motion since the odometry before: (position, rotation vector) in odom. The errors of a pose and
  /// of the one before have most in common.
  Matrix6d step_covariance = Matrix6d::Zero();

  /// Rises when the poses before and after have no known connection, or one that differs from what was given
  /// out: after a loss of tracking, in a new submap, after withdrawn poses or a reset of the clock.
  std::size_t resets = 0;

  double quality = 0.0;       ///< tracking quality, 0 (predicted) to 1
  bool is_predicted = false;  ///< extrapolated while dynamic objects hide the scene; covariances grow
};

}  // namespace roslam
