// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/gyroscope.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
constexpr double kKept = 4.0;           // seconds of samples
constexpr double kMaxGap = 0.05;        // seconds between samples, and beyond the newest
constexpr double kFastest = 100.0;      // rad/s; no gyroscope measures more
constexpr double kFirstSigma = 0.1;     // rad/s of the bias of an uncalibrated unit
constexpr double kChiSquared3 = 16.27;  // 99.9 % limit, 3 degrees of freedom
constexpr double kSlowly = 0.05;        // weight of the newest comparison

// exp(v + d) = exp(v) exp(J d) to first order.
Eigen::Matrix3d so3_right_jacobian(const Eigen::Vector3d& v) { return so3_left_jacobian(-v); }
}  // namespace

Gyroscope::Gyroscope(const ImuCalibration& calibration)
    : calibration_(calibration), R_camera_imu_(calibration.T_camera_imu.rotation()) {
  calibration.validate();
  forget_bias();
}

void Gyroscope::forget_bias() {
  bias_.setZero();
  covariance_ = kFirstSigma * kFirstSigma * Eigen::Matrix3d::Identity();
}

GyroscopeState Gyroscope::state() const {
  return {bias_, covariance_.diagonal().cwiseSqrt(), agrees_with_images(), used_, skipped_};
}

void Gyroscope::add(std::span<const InertialSample> samples, double frame_time) {
  constexpr double kLater = 0.1;  // seconds; more is a wrong time, or one before the clock restarted
  for (const InertialSample& sample : samples) {
    const bool is_usable = std::isfinite(sample.timestamp) && sample.turn_rate.allFinite() &&
                           sample.turn_rate.norm() < kFastest && sample.timestamp < frame_time + kLater &&
                           (samples_.empty() || sample.timestamp > samples_.back().timestamp);
    if (!is_usable) {
      ++skipped_;
      continue;
    }
    ++used_;
    samples_.push_back(sample);
    while (sample.timestamp - samples_.front().timestamp > kKept) samples_.pop_front();
  }
}

// By the mean rate of each interval between samples; the rate at the ends is interpolated, beyond the newest
// sample it is taken as constant.
std::optional<Gyroscope::Integral> Gyroscope::integrate(double from, double to) const {
  if (!(to > from) || samples_.empty()) return std::nullopt;
  if (samples_.front().timestamp > from || to - samples_.back().timestamp > kMaxGap) return std::nullopt;
  auto after = std::upper_bound(samples_.begin(), samples_.end(), from,
                                [](double time, const InertialSample& s) { return time < s.timestamp; });
  const auto rate_at = [&](double time) -> Eigen::Vector3d {  // time: between after - 1 and after
    const InertialSample& a = *std::prev(after);
    if (after == samples_.end()) return a.turn_rate;
    const double share = (time - a.timestamp) / (after->timestamp - a.timestamp);
    return (1.0 - share) * a.turn_rate + share * after->turn_rate;
  };
  Integral result{Eigen::Quaterniond::Identity(), Eigen::Matrix3d::Zero()};
  double begin = from;
  while (begin < to) {
    const bool is_last = after == samples_.end() || after->timestamp >= to;
    const double end = is_last ? to : after->timestamp;
    if (after != samples_.end() && after->timestamp - std::prev(after)->timestamp > kMaxGap)
      return std::nullopt;
    const double dt = end - begin;
    const Eigen::Vector3d turned = (0.5 * (rate_at(begin) + rate_at(end)) - bias_) * dt;
    const Eigen::Quaterniond step = so3_exp(turned);
    result.R_from_to = (result.R_from_to * step).normalized();
    result.by_bias = step.toRotationMatrix().transpose() * result.by_bias + so3_right_jacobian(turned) * dt;
    begin = end;
    if (!is_last) ++after;
  }
  return result;
}

std::optional<Turn> Gyroscope::turn(double from, double to) const {
  const auto integral = integrate(from, to);
  if (!integral) return std::nullopt;
  // R_to_from = exp(by_bias d) R_to_from(b) in the frame of the IMU, for a bias that is larger by d.
  const Eigen::Matrix3d R = R_camera_imu_.toRotationMatrix();
  const Eigen::Matrix3d by_bias = R * integral->by_bias;
  const double white = calibration_.gyroscope_noise * calibration_.gyroscope_noise * (to - from);
  return Turn{R_camera_imu_ * integral->R_from_to.inverse() * R_camera_imu_.inverse(),
              by_bias * covariance_ * by_bias.transpose() + white * Eigen::Matrix3d::Identity()};
}

std::optional<Gyroscope::Comparison> Gyroscope::compare(double from, double to, const Turn& seen) const {
  const auto integral = integrate(from, to);
  if (!integral) return std::nullopt;
  Comparison result;
  const Eigen::Quaterniond seen_in_imu = R_camera_imu_.inverse() * seen.R_to_from * R_camera_imu_;
  // exp(residual) = R_to_from R_from_to(b) = exp(by_bias d) where the true bias is larger than b by d.
  result.residual = so3_log(seen_in_imu * integral->R_from_to);
  result.by_bias = integral->by_bias;
  const Eigen::Matrix3d R = R_camera_imu_.toRotationMatrix();
  const double white = calibration_.gyroscope_noise * calibration_.gyroscope_noise * (to - from);
  // The covariance of poses does not contain all errors, as of a rolling shutter.
  constexpr double kLeast = 0.002;  // rad
  result.noise =
      R.transpose() * seen.covariance * R + (white + kLeast * kLeast) * Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d all = result.by_bias * covariance_ * result.by_bias.transpose() + result.noise;
  result.squared = result.residual.dot(all.inverse() * result.residual);
  return result;
}

void Gyroscope::correct(double from, double to, const Turn& seen) {
  const double walk = calibration_.gyroscope_walk * calibration_.gyroscope_walk;
  covariance_ += walk * (to - from) * Eigen::Matrix3d::Identity();
  const auto comparison = compare(from, to, seen);
  if (!comparison) return;
  const bool contradicts = comparison->squared > kChiSquared3;
  disagreement_ += kSlowly * ((contradicts ? 1.0 : 0.0) - disagreement_);
  if (!agrees_with_images()) forget_bias();  // it may have been learnt from wrong rotations
  if (contradicts) return;
  const Eigen::Matrix3d& H = comparison->by_bias;
  const Eigen::Matrix3d S = H * covariance_ * H.transpose() + comparison->noise;
  const Eigen::Matrix3d gain = covariance_ * H.transpose() * S.inverse();
  bias_ += gain * comparison->residual;
  const Eigen::Matrix3d left = Eigen::Matrix3d::Identity() - gain * H;
  covariance_ = left * covariance_ * left.transpose() + gain * comparison->noise * gain.transpose();
}

void Gyroscope::note_refusal() { disagreement_ += kSlowly * (1.0 - disagreement_); }

bool Gyroscope::contradicts(double from, double to, const Turn& seen) const {
  if (!agrees_with_images()) return false;
  constexpr double kWider = 4.0;      // than for the bias, as blurred images are no contradiction
  constexpr double kClearly = 0.035;  // rad
  const auto comparison = compare(from, to, seen);
  return comparison && comparison->squared > kWider * kChiSquared3 && comparison->residual.norm() > kClearly;
}

}  // namespace roslam
