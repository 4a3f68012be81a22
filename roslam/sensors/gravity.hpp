// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <deque>
#include <optional>
#include <span>

#include "roslam/sensors/inertial_sample.hpp"

namespace roslam {

/// A pose of the inertial measurement unit as it was tracked.
struct TrackedImu {
  double timestamp = 0.0;  ///< seconds
  Eigen::Quaterniond R_world_imu;
  Eigen::Vector3d velocity;  ///< of the unit in the world frame, m/s
};

/// Estimates the direction of gravity by an accelerometer, which measures specific force: acceleration
/// against free fall. At rest its mean points up. In flight the mean specific force over a stretch, turned
/// into the world frame, is gravity and the change of velocity over its duration; with the velocities by
/// tracking, the error falls with the duration. Not thread safe.
class GravityEstimator {
 public:
  /// Samples in the order of time, up to that of a frame (seconds). Those that are not finite, or of more
  /// than 200 m/s^2, are skipped.
  void add(std::span<const InertialSample> samples);

  /// The direction up in the frame of the unit by the last half second: a unit vector. Nothing where there
  /// are too few samples, or where their mean is not that of gravity.
  std::optional<Eigen::Vector3d> up_in_imu() const;

  /// A pose that was tracked, later than the samples of up to its time were added. Long gaps begin anew.
  void track(const TrackedImu& pose);

  /// The direction up in the world frame by the stretch so far; nothing before it has that duration (seconds)
  /// or if what is found is not of the size of gravity.
  std::optional<Eigen::Vector3d> up_in_world(double duration) const;

  /// To be called when the world frame or the clock changed: the stretch begins anew.
  void restart() { first_.reset(); }

  /// Forgets the samples as well, as after a reset of the clock.
  void restart_clock();

 private:
  void integrate(const TrackedImu& until);

  std::deque<InertialSample> samples_;
  std::optional<TrackedImu> first_;  // of the stretch
  std::optional<TrackedImu> last_;
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero();  // integral in the world frame, m/s
  double integrated_ = 0.0;                          // seconds that have samples
};

}  // namespace roslam
