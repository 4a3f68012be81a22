// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "roslam/sensors/inertial_sample.hpp"

namespace roslam {

/// Inertial samples that wait for the frame they belong to. Those of a gyroscope and an accelerometer that
/// measure at times of their own are joined: each turn rate, which comes more often, with the newest
/// acceleration. A clock has restarted, or leapt, where two samples in a row show it; one with a time far
/// from the others is left out. Bounded: of very many the oldest are lost. Not thread safe.
class InertialQueue {
 public:
  void add(const InertialSample& sample) {
    const double time = sample.timestamp;
    const auto candidate = std::exchange(candidate_, std::nullopt);
    const bool is_expected = !last_ || (time > *last_ - kRestart && time < *last_ + kLongestGap);
    if (!is_expected && !(candidate && std::abs(time - candidate->timestamp) < kRestart)) {
      candidate_ = sample;
      return;
    }
    if (!is_expected) {
      if (time < *last_) {
        ++restarts_;
        last_.reset();
      }
      push(*candidate);
    }
    push(sample);
  }

  void add_acceleration(const Eigen::Vector3d& acceleration) { acceleration_ = acceleration; }

  /// Lost as long as there is no acceleration.
  void add_turn_rate(double timestamp, const Eigen::Vector3d& turn_rate) {
    if (acceleration_) add({timestamp, turn_rate, *acceleration_});
  }

  /// Takes the samples until the time of a frame, in seconds. segment: of the frame. Samples after a restart
  /// of their clock are for the frames after the restart, though their times are earlier.
  std::vector<InertialSample> take_until(double timestamp, int segment) {
    // The frames have followed the restart, or it was of the inertial unit alone.
    const bool follows = segment != segment_ || (last_ && std::abs(timestamp - *last_) < kRestart);
    segment_ = segment;
    if (follows) taken_restarts_ = restarts_;
    while (!samples_.empty() && samples_.front().restarts < taken_restarts_) samples_.pop_front();
    std::vector<InertialSample> taken;
    while (!samples_.empty() && samples_.front().restarts == taken_restarts_ &&
           samples_.front().sample.timestamp <= timestamp) {
      taken.push_back(samples_.front().sample);
      samples_.pop_front();
    }
    return taken;
  }

 private:
  struct Waiting {
    InertialSample sample;
    int restarts;  // of its clock before it
  };

  static constexpr std::size_t kMost = 4000;
  static constexpr double kRestart = 1.0;     // seconds that a clock goes back by
  static constexpr double kLongestGap = 0.1;  // seconds; a sample later than that has to be confirmed

  void push(const InertialSample& sample) {
    last_ = std::max(sample.timestamp, last_.value_or(sample.timestamp));
    samples_.push_back({sample, restarts_});
    if (samples_.size() > kMost) samples_.pop_front();
  }

  std::deque<Waiting> samples_;
  std::optional<Eigen::Vector3d> acceleration_;
  std::optional<double> last_;               // time of the newest sample
  std::optional<InertialSample> candidate_;  // may be the first after a restart
  int restarts_ = 0, taken_restarts_ = 0;
  int segment_ = 0;
};

}  // namespace roslam
