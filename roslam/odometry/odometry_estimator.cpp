// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/odometry/odometry_estimator.hpp"

#include <cmath>

#include "roslam/tracking/pose_covariance.hpp"

namespace roslam {

namespace {
constexpr double kKept = 2.0;  // seconds of placed frames: poses are withdrawn within less

double yaw_of(const SE3& T_world_body) {
  const Eigen::Vector3d ahead = T_world_body.rotation() * Eigen::Vector3d::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

// Of T_camera_world, perturbed in the camera frame, to that of T_odom_body in odom.
Matrix6d covariance_in_odom(const Matrix6d& by_camera, const SE3& T_body_camera, const SE3& T_odom_body) {
  return covariance_in_world(T_odom_body, carried(by_camera, T_body_camera));
}
}  // namespace

std::optional<Odometry> OdometryEstimator::add(const TrackedFrame& frame, SubmapId submap) {
  const bool is_tracked = frame.state == TrackingState::kTracking;
  const bool is_placed =
      is_tracked || frame.motion;  // a poor fit is withheld, but what follows is measured from it
  if (is_placed) {
    place(frame, submap);
    if (is_tracked) {
      filter(frame);
      return output(frame, false);
    }
    return std::nullopt;
  }
  if (frame.state == TrackingState::kPredicted && !starts_ && !placed_.empty()) {
    filter_.predict(frame.timestamp);
    return output(frame, true);
  }
  is_interrupted_ = true;
  return std::nullopt;
}

// Where the frame is in odom, by its motion since an earlier one.
void OdometryEstimator::place(const TrackedFrame& frame, SubmapId submap) {
  const bool is_first = placed_.empty();
  const std::size_t before = placed_.size();
  while (frame.motion && !placed_.empty() && placed_.back().timestamp > frame.motion->since)
    placed_.pop_back();
  const bool is_connected =
      frame.motion && !placed_.empty() && placed_.back().timestamp == frame.motion->since;
  const bool is_withdrawn = placed_.size() < before;
  if (!is_first && (is_interrupted_ || is_withdrawn || !is_connected)) {
    ++resets_;
    starts_ = true;
  }
  is_interrupted_ = false;
  SE3 T_odom_camera;
  if (is_connected) {
    T_odom_camera = placed_.back().T_odom_camera * frame.motion->T_camera_since.inverse();
  } else {
    T_odom_camera = beside_last(frame);
    placed_.clear();
  }
  placed_.push_back({frame.timestamp, T_odom_camera});
  while (frame.timestamp - placed_.front().timestamp > kKept && placed_.size() > 1) placed_.pop_front();
  if (!frame.T_camera_world) return;
  T_map_odom_ = frame.T_camera_world->inverse() * T_odom_camera.inverse();
  if (submap != submap_) T_map_odom_at_start_ = T_map_odom_;  // submaps were merged: another world
  submap_ = submap;
}

// The pose of a frame whose connection with those before is not known: at the last position, with the last
// heading, and with the new attitude against gravity.
SE3 OdometryEstimator::beside_last(const TrackedFrame& frame) const {
  const SE3 T_map_camera = frame.T_camera_world ? frame.T_camera_world->inverse() : SE3();
  if (placed_.empty()) return T_map_camera;
  const SE3 T_odom_last = placed_.back().T_odom_camera * T_body_camera_.inverse();
  const SE3 T_map_body = T_map_camera * T_body_camera_.inverse();
  const Eigen::Quaterniond turn(
      Eigen::AngleAxisd(yaw_of(T_odom_last) - yaw_of(T_map_body), Eigen::Vector3d::UnitZ()));
  const SE3 T_odom_body(turn * T_map_body.rotation(), T_odom_last.translation());
  return T_odom_body * T_body_camera_;
}

void OdometryEstimator::filter(const TrackedFrame& frame) {
  const SE3 T_odom_body = placed_.back().T_odom_camera * T_body_camera_.inverse();
  // What the features of an image have in common is in the next image as well, and no noise.
  constexpr double kLeastPosition = 1e-3, kLeastRotation = 2e-4;  // metres, radians; of images at best
  Matrix6d noise = covariance_in_odom(frame.measurement_covariance, T_body_camera_, T_odom_body);
  noise.diagonal().head<3>().array() += kLeastPosition * kLeastPosition;
  noise.diagonal().tail<3>().array() += kLeastRotation * kLeastRotation;
  constexpr double kLongest = 1.0;  // seconds; the motion before says nothing after
  if (starts_ || frame.timestamp - filter_.timestamp() > kLongest) {
    filter_.start(frame.timestamp, T_odom_body, noise);
    if (starts_) T_map_odom_at_start_ = T_map_odom_;
    starts_ = false;
  } else {
    filter_.predict(frame.timestamp);
    filter_.update(T_odom_body, noise);
  }
  drift_ = covariance_in_odom(frame.covariance, T_body_camera_, T_odom_body);
  // What the map has been corrected by since odom began is an error of odom.
  const SE3 corrected = T_map_odom_at_start_.inverse() * T_map_odom_ * T_odom_body;
  Vector6d error;
  error << corrected.translation() - T_odom_body.translation(),
      so3_log(corrected.rotation() * T_odom_body.rotation().inverse());
  drift_ += error * error.transpose();
}

Odometry OdometryEstimator::output(const TrackedFrame& frame, bool is_predicted) {
  const FilteredMotion& motion = filter_.state();
  const Eigen::Matrix3d R_body_odom = motion.T_odom_body.rotation().inverse().toRotationMatrix();
  Odometry result;
  result.timestamp = frame.timestamp;
  result.T_odom_body = motion.T_odom_body;
  result.T_map_odom = T_map_odom_;
  result.linear_velocity = R_body_odom * motion.velocity;
  result.angular_velocity = motion.turn_rate;
  result.covariance = drift_ + motion.covariance.topLeftCorner<6, 6>();
  result.step_covariance = motion.step_covariance;
  // In the body frame the velocity has the error of the attitude as well.
  Eigen::Matrix<double, 6, 12> J = Eigen::Matrix<double, 6, 12>::Zero();
  J.block<3, 3>(0, 3) = R_body_odom * skew(motion.velocity);
  J.block<3, 3>(0, 6) = R_body_odom;
  J.block<3, 3>(3, 9).setIdentity();
  result.velocity_covariance = J * motion.covariance * J.transpose();
  result.resets = resets_;
  result.quality = is_predicted ? 0.0 : frame.quality;
  result.is_predicted = is_predicted;
  return result;
}

void OdometryEstimator::restart_clock(double timestamp) {
  if (placed_.empty()) return;
  placed_ = {{timestamp, placed_.back().T_odom_camera}};
  is_interrupted_ = starts_ = true;
}

}  // namespace roslam
