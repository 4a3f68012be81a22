// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/mavlink/odometry_message.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace roslam::telemetry {

namespace {
// FRD from FLU, and back.
const Eigen::DiagonalMatrix<double, 3> kTurned(1.0, -1.0, -1.0);

// To the change of roll, pitch and yaw from a small rotation vector on the left of the rotation.
Eigen::Matrix3d angles_from_rotation_vector(const Eigen::Matrix3d& R) {
  constexpr double kVertical = 0.1;  // cosine of the pitch
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  if (cos_pitch < kVertical) return R.transpose();
  const double sin_pitch = -R(2, 0);
  const double cos_yaw = R(0, 0) / cos_pitch, sin_yaw = R(1, 0) / cos_pitch;
  const double tan_pitch = sin_pitch / cos_pitch;
  Eigen::Matrix3d J;
  J << cos_yaw / cos_pitch, sin_yaw / cos_pitch, 0.0,  //
      -sin_yaw, cos_yaw, 0.0,                          //
      cos_yaw * tan_pitch, sin_yaw * tan_pitch, 1.0;
  return J;
}

// J * covariance * J^T for J of two blocks, as its upper triangle by rows.
std::array<float, 21> upper_triangle(const Eigen::Matrix3d& first, const Eigen::Matrix3d& second,
                                     const Matrix6d& covariance) {
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = first;
  J.bottomRightCorner<3, 3>() = second;
  const Matrix6d turned = J * covariance * J.transpose();
  std::array<float, 21> result{};
  if (!turned.allFinite()) {
    result[0] = std::numeric_limits<float>::quiet_NaN();
    return result;
  }
  std::size_t at = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column) result[at++] = static_cast<float>(turned(row, column));
  return result;
}

std::array<float, 3> floats_of(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

std::int8_t quality_of(const Odometry& odometry) {
  const double most = odometry.is_predicted ? 10.0 : 100.0;
  return static_cast<std::int8_t>(std::clamp(std::round(100.0 * odometry.quality), 1.0, most));
}
}  // namespace

SE3 pose_in(PoseFrame frame, const Odometry& odometry) {
  return frame == PoseFrame::kOdom ? odometry.T_odom_body : odometry.T_map_odom * odometry.T_odom_body;
}

SE3 frd_of(const SE3& flu) {
  const Eigen::Quaterniond& q = flu.rotation();
  return SE3::from_parts({q.w(), q.x(), -q.y(), -q.z()}, kTurned * flu.translation());
}

OdometryMessage odometry_message(PoseFrame frame, const Odometry& odometry) {
  const SE3 pose = frd_of(pose_in(frame, odometry));
  const Eigen::Quaterniond& q = pose.rotation();
  OdometryMessage message;
  message.position = floats_of(pose.translation());
  message.attitude = {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
                      static_cast<float>(q.z())};
  message.velocity = floats_of(kTurned * odometry.linear_velocity);
  message.rates = floats_of(kTurned * odometry.angular_velocity);
  const Eigen::Matrix3d D = kTurned.toDenseMatrix();
  Eigen::Matrix3d R_frame_odom = Eigen::Matrix3d::Identity();
  if (frame == PoseFrame::kMap) R_frame_odom = odometry.T_map_odom.rotation().toRotationMatrix();
  const Eigen::Matrix3d to_frame = D * R_frame_odom;
  message.pose_covariance = upper_triangle(
      to_frame, angles_from_rotation_vector(q.toRotationMatrix()) * to_frame, odometry.covariance);
  message.velocity_covariance = upper_triangle(D, D, odometry.velocity_covariance);
  message.quality = quality_of(odometry);
  return message;
}

}  // namespace roslam::telemetry
