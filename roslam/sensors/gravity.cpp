// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/gravity.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
constexpr double kGravity = 9.81;     // m/s^2
constexpr double kTolerance = 1.5;    // m/s^2, of a mean: what drones do, and poor accelerometers show
constexpr double kRecent = 0.5;       // seconds
constexpr double kKept = 2.0;         // seconds of samples
constexpr double kStrongest = 200.0;  // m/s^2; no accelerometer of a drone measures more
constexpr double kMaxGap = 0.5;       // seconds between tracked poses

bool is_gravity(const Eigen::Vector3d& force) { return std::abs(force.norm() - kGravity) < kTolerance; }
}  // namespace

void GravityEstimator::add(std::span<const InertialSample> samples) {
  for (const InertialSample& sample : samples) {
    const bool is_usable = std::isfinite(sample.timestamp) && sample.acceleration.norm() < kStrongest &&
                           (samples_.empty() || sample.timestamp > samples_.back().timestamp);
    if (!is_usable) continue;
    samples_.push_back(sample);
    while (sample.timestamp - samples_.front().timestamp > kKept) samples_.pop_front();
  }
}

std::optional<Eigen::Vector3d> GravityEstimator::up_in_imu() const {
  constexpr int kFewest = 5;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (auto sample = samples_.rbegin(); sample != samples_.rend(); ++sample) {
    if (samples_.back().timestamp - sample->timestamp > kRecent) break;
    sum += sample->acceleration;
    ++count;
  }
  if (count < kFewest || !is_gravity(sum / count)) return std::nullopt;
  return sum.normalized();
}

void GravityEstimator::track(const TrackedImu& pose) {
  const bool goes_on =
      first_ && pose.timestamp > last_->timestamp && pose.timestamp - last_->timestamp < kMaxGap;
  if (goes_on) {
    integrate(pose);
  } else {
    first_ = pose;
    force_.setZero();
    integrated_ = 0.0;
  }
  last_ = pose;
}

// Each sample stands for the time since the one before, the last one for the rest as well, within limits.
void GravityEstimator::integrate(const TrackedImu& until) {
  constexpr double kMaxRest = 0.02;  // seconds that a sample stands for
  const double begin = last_->timestamp;
  const double duration = until.timestamp - begin;
  double reached = begin;
  const auto add = [&](const InertialSample& sample, double time) {
    reached = std::max(reached, time - kMaxRest);  // nothing stands for what is missing
    const double middle = (0.5 * (reached + time) - begin) / duration;
    force_ += last_->R_world_imu.slerp(middle, until.R_world_imu) * sample.acceleration * (time - reached);
    integrated_ += time - reached;
    reached = time;
  };
  const InertialSample* newest = nullptr;
  for (const InertialSample& sample : samples_) {
    if (sample.timestamp <= begin) continue;
    newest = &sample;
    add(sample, std::min(sample.timestamp, until.timestamp));
    if (sample.timestamp >= until.timestamp) break;
  }
  if (newest != nullptr && until.timestamp - reached < kMaxRest) add(*newest, until.timestamp);
}

std::optional<Eigen::Vector3d> GravityEstimator::up_in_world(double duration) const {
  if (!first_ || last_->timestamp - first_->timestamp < duration) return std::nullopt;
  const double elapsed = last_->timestamp - first_->timestamp;
  constexpr double kMissing = 0.1;  // share of the time that may lack samples
  if (integrated_ < (1.0 - kMissing) * elapsed) return std::nullopt;
  const Eigen::Vector3d gravity = force_ / integrated_ - (last_->velocity - first_->velocity) / elapsed;
  if (!is_gravity(gravity)) return std::nullopt;
  return gravity.normalized();
}

void GravityEstimator::restart_clock() {
  samples_.clear();
  restart();
}

}  // namespace roslam
