// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/motion_model.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
double position_sigma(const TrackedFrame& frame) {
  return largest_sigma(frame.measurement_covariance.topLeftCorner<3, 3>());
}
}  // namespace

bool is_same_submap(const Map& map, KeyframeId a, KeyframeId b) {
  return a.is_valid() && b.is_valid() && map.submap_of(a) == map.submap_of(b);
}

MotionModel::MotionModel(const Camera& camera, const Map& map, const PlausibilityOptions& plausible,
                         bool use_gyroscope)
    : map_(map), plausible_(plausible) {
  if (camera.imu && use_gyroscope) gyroscope_.emplace(*camera.imu);
}

void MotionModel::add_inertial(std::span<const InertialSample> samples, double frame_time) {
  if (gyroscope_) gyroscope_->add(samples, frame_time);
}

SE3 MotionModel::by_velocity(const TrackedState& last, double timestamp) const {
  const SE3 T_last_world = *last.T_camera_world(map_);
  if (!last.velocity) return T_last_world;
  constexpr double kSteady = 0.1;  // seconds of constant velocity
  constexpr double kDecay = 0.4;   // seconds, time constant
  const double elapsed = timestamp - last.frame.timestamp;
  const double beyond = std::max(elapsed - kSteady, 0.0);
  const double duration = std::min(elapsed, kSteady) + kDecay * (1.0 - std::exp(-beyond / kDecay));
  return SE3::exp(*last.velocity * duration) * T_last_world;
}

std::optional<SE3> MotionModel::by_gyroscope(const TrackedState& last, double timestamp) const {
  if (!gyroscope_ || !gyroscope_->agrees_with_images()) return std::nullopt;
  const auto turn = gyroscope_->turn(last.frame.timestamp, timestamp);
  if (!turn) return std::nullopt;
  const Eigen::Quaterniond R = turn->R_to_from * last.T_camera_world(map_)->rotation();
  return SE3(R, -(R * by_velocity(last, timestamp).inverse().translation()));
}

SE3 MotionModel::predict(const TrackedState& last, double timestamp) const {
  const auto turned = by_gyroscope(last, timestamp);
  return turned ? *turned : by_velocity(last, timestamp);
}

std::optional<Vector6d> MotionModel::velocity(const TrackedState& since, const TrackedFrame& frame) const {
  const double elapsed = frame.timestamp - since.frame.timestamp;
  constexpr double kMaxGap = 0.5;  // seconds
  if (!is_same_submap(map_, since.frame.reference, frame.reference) || !(elapsed > 0.0 && elapsed < kMaxGap))
    return std::nullopt;
  return Vector6d((*frame.T_camera_world * since.T_camera_world(map_)->inverse()).log() / elapsed);
}

PoseDoubt MotionModel::doubt(const TrackedState& since, const TrackedFrame& frame) const {
  const TrackedFrame& earlier = since.frame;
  if (!is_same_submap(map_, earlier.reference, frame.reference)) return PoseDoubt::kNone;
  constexpr double kLongest = 0.5;  // seconds
  if (gyroscope_ && frame.timestamp - earlier.timestamp <= kLongest &&
      gyroscope_->contradicts(earlier.timestamp, frame.timestamp, turn_since(since, frame)))
    return PoseDoubt::kGyroscope;
  MotionState last;
  last.timestamp = earlier.timestamp;
  last.T_world_camera = since.T_camera_world(map_)->inverse();
  last.sigma = position_sigma(earlier);
  if (since.velocity) last.velocity = -(last.T_world_camera.rotation() * since.velocity->head<3>());
  return check_motion(last, frame.timestamp, frame.T_camera_world->inverse(), position_sigma(frame),
                      plausible_);
}

Turn MotionModel::turn_since(const TrackedState& since, const TrackedFrame& frame) const {
  const Eigen::Quaterniond R =
      frame.T_camera_world->rotation() * since.T_camera_world(map_)->rotation().inverse();
  const Eigen::Matrix3d matrix = R.toRotationMatrix();
  const Eigen::Matrix3d earlier = since.frame.measurement_covariance.bottomRightCorner<3, 3>();
  return {R, matrix * earlier * matrix.transpose() + frame.measurement_covariance.bottomRightCorner<3, 3>()};
}

// By rotations over a tenth of a second, as those between two images are mostly noise.
void MotionModel::learn(const TrackedState& tracked) {
  if (!gyroscope_) return;
  constexpr double kInterval = 0.1;  // seconds
  constexpr double kLongest = 1.0;
  if (learnt_until_) {
    const TrackedFrame& earlier = learnt_until_->frame;
    const double elapsed = tracked.frame.timestamp - earlier.timestamp;
    if (elapsed < kInterval) return;
    if (elapsed < kLongest && is_same_submap(map_, earlier.reference, tracked.frame.reference))
      gyroscope_->correct(earlier.timestamp, tracked.frame.timestamp,
                          turn_since(*learnt_until_, tracked.frame));
  }
  learnt_until_ = tracked;
}

void MotionModel::restart_clock() {
  learnt_until_.reset();
  if (gyroscope_) gyroscope_->restart_clock();
}

}  // namespace roslam
