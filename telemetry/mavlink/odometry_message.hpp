// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "roslam/common/export.hpp"
#include "roslam/odometry/odometry.hpp"
#include "telemetry/mavlink/mavlink_frame.hpp"

namespace roslam::telemetry {

/// Which pose an autopilot is given.
enum class PoseFrame {
  kOdom,  ///< T_odom_body: no correction of the map moves it
  kMap    ///< T_map_odom * T_odom_body: jumps when the map is corrected
};

/// The pose of the body in that frame, x forward, y left, z up.
ROSLAM_EXPORT SE3 pose_in(PoseFrame frame, const Odometry& odometry);

/// The same transform between the frames whose y and z axes are turned round: x forward, y right, z down.
ROSLAM_EXPORT SE3 frd_of(const SE3& flu);

/// Position, attitude, velocity and covariances in LOCAL_FRD and BODY_FRD; time, reset counter and estimator
/// are left as they are by default. The covariance of the attitude is that of roll, pitch and yaw (Z-Y-X), to
/// which the rotation vector in odom is turned by the derivative of the angles; within 6 degrees of the
/// vertical, where there is none, that of the rotation vector about the axes of the body. That of odom holds
/// for both frames: a corrected pose is not worse. A covariance that is not finite is sent as unknown: its
/// first number is NaN. quality: 1 to 100, of predicted poses 10 at most.
ROSLAM_EXPORT OdometryMessage odometry_message(PoseFrame frame, const Odometry& odometry);

}  // namespace roslam::telemetry
