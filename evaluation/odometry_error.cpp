// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/odometry_error.hpp"

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "roslam/common/error.hpp"

namespace roslam::evaluation {

namespace {
constexpr double kMaxTruthGap = 0.2;  // seconds
constexpr double kDegrees = 180.0 / std::numbers::pi;
// Two-sided 99 % bounds of chi-squared, 6 degrees of freedom.
constexpr double kLowerBound = 0.676, kUpperBound = 18.548;

// True body poses and velocities.
class Truth {
 public:
  Truth(const Trajectory& cameras, const SE3& T_body_camera, double interval)
      : cameras_(cameras), T_camera_body_(T_body_camera.inverse()), interval_(interval) {}

  std::optional<SE3> body(double time) const {
    const auto camera = pose_at(cameras_, time, kMaxTruthGap);
    if (!camera) return std::nullopt;
    return camera->T_world_camera * T_camera_body_;
  }

  // (linear, angular), in the body frame.
  std::optional<Vector6d> velocity(double time) const {
    const auto before = body(time - interval_), now = body(time), after = body(time + interval_);
    if (!before || !now || !after) return std::nullopt;
    Vector6d result;
    result << now->rotation().inverse() * (after->translation() - before->translation()),
        so3_log(before->rotation().inverse() * after->rotation());
    return result / (2.0 * interval_);
  }

 private:
  const Trajectory& cameras_;
  SE3 T_camera_body_;
  double interval_;  // seconds between two frames
};

double median_interval(const std::vector<Odometry>& odometry) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < odometry.size(); ++i)
    intervals.push_back(odometry[i].timestamp - odometry[i - 1].timestamp);
  return median(std::move(intervals));
}

void compare_steps(const std::vector<Odometry>& odometry, const Truth& truth, double interval,
                   OdometryError& error) {
  constexpr double kNextFrame = 1.5;  // intervals
  std::vector<double> metres, degrees;
  for (std::size_t i = 1; i < odometry.size(); ++i) {
    const Odometry &a = odometry[i - 1], &b = odometry[i];
    const SE3 in_map = b.T_map_odom * b.T_odom_body;
    const SE3 as_before = a.T_map_odom * b.T_odom_body;
    if (a.resets == b.resets)
      error.largest_correction =
          std::max(error.largest_correction, (in_map.translation() - as_before.translation()).norm());
    const auto true_a = truth.body(a.timestamp), true_b = truth.body(b.timestamp);
    const bool is_step = a.resets == b.resets && b.timestamp - a.timestamp < kNextFrame * interval;
    if (!is_step || !true_a || !true_b) continue;
    const SE3 off = (true_a->inverse() * *true_b).inverse() * (a.T_odom_body.inverse() * b.T_odom_body);
    metres.push_back(off.translation().norm());
    degrees.push_back(off.angle() * kDegrees);
  }
  error.step = summarise(metres);
  error.step_rotation = summarise(degrees);
}

void compare_velocities(const std::vector<Odometry>& odometry, const Truth& truth, OdometryError& error) {
  std::vector<double> linear, angular, squared;
  std::size_t below = 0, above = 0;
  for (const Odometry& o : odometry) {
    const auto true_velocity = truth.velocity(o.timestamp);
    if (!true_velocity) continue;
    Vector6d off;
    off << o.linear_velocity, o.angular_velocity;
    off -= *true_velocity;
    linear.push_back(off.head<3>().norm());
    angular.push_back(off.tail<3>().norm() * kDegrees);
    squared.push_back(off.dot(o.velocity_covariance.ldlt().solve(off)));
    below += squared.back() < kLowerBound ? 1 : 0;
    above += squared.back() < kUpperBound ? 0 : 1;
  }
  error.compared = linear.size();
  if (linear.empty()) return;
  error.velocity = summarise(linear);
  error.turn_rate = summarise(angular);
  error.nees = summarise(squared).mean;
  error.below_bounds = static_cast<double>(below) / static_cast<double>(squared.size());
  error.above_bounds = static_cast<double>(above) / static_cast<double>(squared.size());
}

// Mean squared error against the true velocity of an earlier time.
double error_at(const std::vector<Odometry>& odometry, const Truth& truth, double delay) {
  double sum = 0.0;
  int count = 0;
  for (const Odometry& o : odometry) {
    const auto then = truth.velocity(o.timestamp - delay);
    if (!then) continue;
    sum += (o.linear_velocity - then->head<3>()).squaredNorm();
    ++count;
  }
  return count > 0 ? sum / count : 0.0;
}

std::optional<double> delay_of(const std::vector<Odometry>& odometry, const Truth& truth, double interval) {
  constexpr double kEarliest = -0.1, kLatest = 0.3, kStep = 0.005;  // seconds
  constexpr double kAdds = 1.25;
  double best = kEarliest, least = error_at(odometry, truth, kEarliest);
  for (double delay = kEarliest + kStep; delay < kLatest; delay += kStep) {
    const double now = error_at(odometry, truth, delay);
    if (now < least) {
      least = now;
      best = delay;
    }
  }
  const bool is_clear = error_at(odometry, truth, best - interval) > kAdds * least &&
                        error_at(odometry, truth, best + interval) > kAdds * least;
  return is_clear ? std::optional(best) : std::nullopt;
}

double tilt_of(const std::vector<Odometry>& odometry, const Truth& truth) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Odometry& o : odometry) {
    const auto body = truth.body(o.timestamp);
    if (!body) continue;
    sum += ((o.T_map_odom * o.T_odom_body).rotation() * body->rotation().inverse()).toRotationMatrix();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d mean = svd.matrixU() * svd.matrixV().transpose();
  return std::acos(std::clamp(mean(2, 2), -1.0, 1.0)) * kDegrees;
}
}  // namespace

OdometryError evaluate_odometry(const Trajectory& truth, const std::vector<Odometry>& odometry,
                                const SE3& T_body_camera) {
  constexpr std::size_t kFewest = 10;
  OdometryError error;
  error.frames = odometry.size();
  const double interval = median_interval(odometry);
  const Truth poses(truth, T_body_camera, interval);
  if (odometry.size() >= kFewest && interval > 0.0) compare_velocities(odometry, poses, error);
  if (error.compared < kFewest)
    throw InputError("only " + std::to_string(error.compared) + " of " + std::to_string(error.frames) +
                     " frames with odometry lie within the truth; is it of the same recording?");
  compare_steps(odometry, poses, interval, error);
  const std::size_t first = odometry.front().resets, last = odometry.back().resets;
  error.resets = last > first ? last - first : 0;
  error.delay = delay_of(odometry, poses, interval);
  error.tilt = tilt_of(odometry, poses);
  return error;
}

}  // namespace roslam::evaluation
