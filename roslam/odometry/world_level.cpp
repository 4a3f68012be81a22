// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/odometry/world_level.hpp"

#include <array>
#include <numbers>

namespace roslam {

namespace {
constexpr std::array kDurations{2.0, 5.0, 10.0, 20.0};  // seconds of tracking by which gravity is refined
}

WorldLevel::WorldLevel(const Camera& camera) : T_body_camera_(camera.T_body_camera) {
  if (camera.imu) T_body_imu_ = camera.T_body_camera * camera.imu->T_camera_imu;
}

void WorldLevel::add_inertial(std::span<const InertialSample> samples) {
  if (T_body_imu_) gravity_.add(samples);
}

SE3 WorldLevel::T_camera_start(bool is_first) const {
  SE3 T_world_body;
  if (is_first && initial_T_world_body_) {
    T_world_body = *initial_T_world_body_;
  } else if (T_body_imu_) {
    if (const auto up = gravity_.up_in_imu())
      T_world_body = SE3(level_attitude(T_body_imu_->rotation() * *up), Eigen::Vector3d::Zero());
  }
  return (T_world_body * T_body_camera_).inverse();
}

void WorldLevel::track(const std::optional<Odometry>& odometry) {
  constexpr double kCertain = 0.15;  // m/s; the first velocities are guesses
  if (!T_body_imu_ || !odometry || odometry->is_predicted) return;
  if (odometry->velocity_covariance.topLeftCorner<3, 3>().trace() > kCertain * kCertain) return;
  const SE3 T_world_body = odometry->T_map_odom * odometry->T_odom_body;
  const Eigen::Vector3d velocity =
      odometry->linear_velocity + odometry->angular_velocity.cross(T_body_imu_->translation());
  gravity_.track({odometry->timestamp, T_world_body.rotation() * T_body_imu_->rotation(),
                  T_world_body.rotation() * velocity});
}

std::optional<Eigen::Quaterniond> WorldLevel::correction() {
  if (!T_body_imu_ || initial_T_world_body_ || refined_ == kDurations.size()) return std::nullopt;
  const auto up = gravity_.up_in_world(kDurations[refined_]);
  if (!up) return std::nullopt;
  ++refined_;
  constexpr double kWorthIt = 0.2 * std::numbers::pi / 180.0;  // radians
  const auto R_level_world = Eigen::Quaterniond::FromTwoVectors(*up, Eigen::Vector3d::UnitZ());
  if (so3_log(R_level_world).norm() < kWorthIt) return std::nullopt;
  gravity_.restart();
  return R_level_world;
}

}  // namespace roslam
