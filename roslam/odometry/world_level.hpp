// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "roslam/geometry/camera.hpp"
#include "roslam/odometry/odometry.hpp"
#include "roslam/sensors/gravity.hpp"

namespace roslam {

/// Keeps the z axis of the world against gravity: says at which pose a submap begins, and how the world has
/// to be turned once gravity is known better. By the accelerometer, if Camera::imu is set: its mean at first,
/// and with the velocities by tracking later. Else the body is taken to be level where a submap begins. Not
/// thread safe.
class WorldLevel {
 public:
  explicit WorldLevel(const Camera& camera);

  /// The pose that the first submap begins with, in place of a level one in the origin.
  void set_initial_pose(const SE3& T_world_body) { initial_T_world_body_ = T_world_body; }

  void add_inertial(std::span<const InertialSample> samples);

  /// T_camera_world of the first frame of a submap: the body in the origin, without yaw. is_first: of all.
  SE3 T_camera_start(bool is_first) const;

  /// A tracked pose; nothing where there is none.
  void track(const std::optional<Odometry>& odometry);

  /// R_level_world to turn the world with, if it is tilted by what has been seen. Known a few times only, at
  /// growing durations. After it was given, poses are expected in the world that was turned.
  std::optional<Eigen::Quaterniond> correction();

  /// To be called when the map was corrected or the world changed otherwise.
  void restart() { gravity_.restart(); }
  void restart_clock() { gravity_.restart_clock(); }

 private:
  SE3 T_body_camera_;
  std::optional<SE3> T_body_imu_;
  std::optional<SE3> initial_T_world_body_;
  GravityEstimator gravity_;
  std::size_t refined_ = 0;  // times
};

}  // namespace roslam
