// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string_view>
#include <vector>

#include "roslam/geometry/se3.hpp"
#include "roslam/tracking/tracking_options.hpp"

namespace roslam {

/// Why an estimated pose is not taken for the true one.
enum class PoseDoubt {
  kNone,          ///< it is
  kFewInliers,    ///< too few landmarks agree
  kFewFound,      ///< too few of the landmarks that the pose puts into view are found
  kUncertain,     ///< position or rotation is hardly constrained along some direction
  kPoorFit,       ///< few of them are found, and the matches are off by much, as in a blurred image
  kSpeed,         ///< the camera would have moved faster than plausible.max_speed
  kAcceleration,  ///< its velocity would have changed faster than plausible.max_acceleration
  kTurnRate,      ///< it would have turned faster than plausible.max_turn_rate
  kGyroscope      ///< it would have turned otherwise than the gyroscope shows
};

/// In words, for reports.
std::string_view describe(PoseDoubt doubt);

/// Standard deviation along the least certain direction, by the covariance of a position or a rotation.
double largest_sigma(const Eigen::Matrix3d& covariance);

/// Whether the inliers constrain a pose, by its covariance as OptimisedPose gives it.
PoseDoubt check_certainty(const Matrix6d& covariance, const PlausibilityOptions& options);

/// The directions (unit length, camera frame) along which they constrain the position to no better than
/// plausible.constrained_sigma; at most three, orthogonal.
std::vector<Eigen::Vector3d> unconstrained_directions(const Matrix6d& covariance,
                                                      const PlausibilityOptions& options);

/// The last pose that was accepted, and the velocity with which the camera came there.
struct MotionState {
  double timestamp = 0.0;  ///< seconds
  SE3 T_world_camera;
  double sigma = 0.0;                       ///< of the position, metres
  std::optional<Eigen::Vector3d> velocity;  ///< world, m/s; nothing: unknown
};

/// Whether the camera can have moved from the last pose to this one. sigma: of its position, metres; the
/// limits allow for three sigmas of both poses.
PoseDoubt check_motion(const MotionState& last, double timestamp, const SE3& T_world_camera, double sigma,
                       const PlausibilityOptions& options);

}  // namespace roslam
