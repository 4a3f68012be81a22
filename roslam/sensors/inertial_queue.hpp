// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "roslam/sensors/inertial_sample.hpp"

namespace roslam {

/// Inertial samples that wait for the frame they belong to. Those of a gyroscope and an accelerometer that
/// measure at times of their own are joined: each turn rate, which comes more often, with the newest
/// acceleration. Bounded: of very many the oldest are lost. A clock that goes back by more than a second
/// begins anew. Not thread safe.
class InertialQueue {
 public:
  void add(const InertialSample& sample) {
    if (!samples_.empty() && sample.timestamp < samples_.back().timestamp - kRestart) samples_.clear();
    samples_.push_back(sample);
    if (samples_.size() > kMost) samples_.pop_front();
  }

  void add_acceleration(const Eigen::Vector3d& acceleration) { acceleration_ = acceleration; }

  /// Lost as long as there is no acceleration.
  void add_turn_rate(double timestamp, const Eigen::Vector3d& turn_rate) {
    if (acceleration_) add({timestamp, turn_rate, *acceleration_});
  }

  /// Takes the samples until a time, in seconds.
  std::vector<InertialSample> take_until(double timestamp) {
    std::vector<InertialSample> taken;
    while (!samples_.empty() && samples_.front().timestamp <= timestamp) {
      taken.push_back(samples_.front());
      samples_.pop_front();
    }
    return taken;
  }

 private:
  static constexpr std::size_t kMost = 4000;
  static constexpr double kRestart = 1.0;  // seconds

  std::deque<InertialSample> samples_;
  std::optional<Eigen::Vector3d> acceleration_;
};

}  // namespace roslam
