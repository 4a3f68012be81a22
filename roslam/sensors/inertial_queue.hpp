// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "roslam/sensors/inertial_sample.hpp"

namespace roslam {

/// Inertial samples that wait for the frame they belong to. Those of a gyroscope and an accelerometer that
/// measure at times of their own are joined: each turn rate, which comes more often, with the newest
/// acceleration. Bounded: of very many the oldest are lost. Not thread safe.
class InertialQueue {
 public:
  void add(const InertialSample& sample) {
    if (last_ && sample.timestamp < *last_ - kRestart) ++restarts_;
    last_ = sample.timestamp;
    samples_.push_back({sample, restarts_});
    if (samples_.size() > kMost) samples_.pop_front();
  }

  void add_acceleration(const Eigen::Vector3d& acceleration) { acceleration_ = acceleration; }

  /// Lost as long as there is no acceleration.
  void add_turn_rate(double timestamp, const Eigen::Vector3d& turn_rate) {
    if (acceleration_) add({timestamp, turn_rate, *acceleration_});
  }

  /// Takes the samples until the time of a frame, in seconds. segment: of the frame. Samples after a restart of
  /// their clock are for the frames after the restart, though their times are earlier.
  std::vector<InertialSample> take_until(double timestamp, int segment) {
    if (segment != segment_) {
      segment_ = segment;
      while (!samples_.empty() && samples_.front().restarts < restarts_) samples_.pop_front();
      taken_restarts_ = restarts_;
    }
    std::vector<InertialSample> taken;
    while (!samples_.empty()) {
      const auto& [sample, restarts] = samples_.front();
      const bool is_of_frame = restarts == taken_restarts_ || timestamp - sample.timestamp < kRestart;
      if (sample.timestamp > timestamp || !is_of_frame) break;
      taken.push_back(sample);
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
  static constexpr double kRestart = 1.0;  // seconds that a clock goes back by

  std::deque<Waiting> samples_;
  std::optional<Eigen::Vector3d> acceleration_;
  std::optional<double> last_;
  int restarts_ = 0, taken_restarts_ = 0;
  int segment_ = 0;
};

}  // namespace roslam
