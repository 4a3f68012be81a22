// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "roslam/odometry/odometry.hpp"
#include "telemetry/mavlink/mavlink_frame.hpp"
#include "telemetry/mavlink/odometry_message.hpp"

/// What an ODOMETRY message says of an Odometry by the conventions of MAVLink, worked out another way than
/// the library does: derivatives by differences.
namespace roslam::telemetry::convention {

/// The pose of the body that is sent, x forward, y left, z up. error: of T_odom_body (position m, rotation
/// vector rad) in odom.
inline SE3 sent_pose(PoseFrame frame, const Odometry& odometry, const Vector6d& error = Vector6d::Zero()) {
  const Eigen::Vector3d turn = error.tail<3>();
  const Eigen::AngleAxisd rotation(turn.norm(),
                                   turn.isZero(0.0) ? Eigen::Vector3d::UnitX().eval() : turn.normalized());
  const SE3 pose(Eigen::Quaterniond(rotation) * odometry.T_odom_body.rotation(),
                 odometry.T_odom_body.translation() + error.head<3>());
  return frame == PoseFrame::kMap ? odometry.T_map_odom * pose : pose;
}

/// Position, and roll, pitch and yaw of the axes forward, right, down, as R = Rz(yaw) Ry(pitch) Rx(roll).
inline Vector6d coordinates(const SE3& flu) {
  Eigen::Matrix3d R = flu.rotation().toRotationMatrix();
  R.row(1) *= -1.0;
  R.row(2) *= -1.0;
  R.col(1) *= -1.0;
  R.col(2) *= -1.0;
  const Eigen::Vector3d& p = flu.translation();
  Vector6d result;
  result << p.x(), -p.y(), -p.z(), std::atan2(R(2, 1), R(2, 2)), -std::asin(R(2, 0)),
      std::atan2(R(1, 0), R(0, 0));
  return result;
}

/// Of coordinates(sent_pose()).
inline Matrix6d pose_covariance(PoseFrame frame, const Odometry& odometry) {
  constexpr double kStep = 1e-6;
  Matrix6d J;
  for (int k = 0; k < 6; ++k) {
    const Vector6d step = kStep * Vector6d::Unit(k);
    Vector6d change =
        coordinates(sent_pose(frame, odometry, step)) - coordinates(sent_pose(frame, odometry, -step));
    for (int angle = 3; angle < 6; ++angle)
      change(angle) = std::remainder(change(angle), 2.0 * std::numbers::pi);
    J.col(k) = change / (2.0 * kStep);
  }
  return J * odometry.covariance * J.transpose();
}

/// Of (velocity, rates) along forward, right, down.
inline Matrix6d velocity_covariance(const Odometry& odometry) {
  const double signs[] = {1.0, -1.0, -1.0, 1.0, -1.0, -1.0};
  Matrix6d result;
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      result(row, column) = signs[row] * signs[column] * odometry.velocity_covariance(row, column);
  return result;
}

inline void expect_upper_triangle(const std::array<float, 21>& sent, const Matrix6d& expected) {
  const std::size_t diagonal[] = {0, 6, 11, 15, 18, 20};
  for (int row = 0; row < 6; ++row) {
    EXPECT_GT(sent[diagonal[row]], 0.0F) << row;
    for (int column = row; column < 6; ++column) {
      const std::size_t at = diagonal[row] + static_cast<std::size_t>(column - row);
      const double scale = std::sqrt(expected(row, row) * expected(column, column));
      EXPECT_NEAR(sent[at], expected(row, column), 1e-5 * scale) << row << ", " << column;
    }
  }
}

template <std::size_t kSize>
void expect_near(const std::array<float, kSize>& sent, const std::array<double, kSize>& expected) {
  for (std::size_t i = 0; i < kSize; ++i) EXPECT_NEAR(sent[i], expected[i], 1e-6) << i;
}

/// All but time, reset counter and estimator.
inline void expect_sent(const OdometryMessage& message, PoseFrame frame, const Odometry& odometry) {
  const SE3 pose = sent_pose(frame, odometry);
  const Eigen::Vector3d &p = pose.translation(), &v = odometry.linear_velocity,
                        &w = odometry.angular_velocity;
  const Eigen::Quaterniond& q = pose.rotation();
  expect_near(message.position, std::array{p.x(), -p.y(), -p.z()});
  expect_near(message.attitude, std::array{q.w(), q.x(), -q.y(), -q.z()});
  expect_near(message.velocity, std::array{v.x(), -v.y(), -v.z()});
  expect_near(message.rates, std::array{w.x(), -w.y(), -w.z()});
  expect_upper_triangle(message.pose_covariance, pose_covariance(frame, odometry));
  expect_upper_triangle(message.velocity_covariance, velocity_covariance(odometry));
  EXPECT_EQ(message.frame_id, 20) << "MAV_FRAME_LOCAL_FRD";
  EXPECT_EQ(message.child_frame_id, 12) << "MAV_FRAME_BODY_FRD";
  EXPECT_EQ(message.quality, std::max(1L, std::lround(100.0 * odometry.quality)));
}

}  // namespace roslam::telemetry::convention
