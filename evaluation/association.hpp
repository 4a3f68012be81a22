// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "roslam/geometry/trajectory.hpp"

namespace roslam::evaluation {

struct AssociationOptions {
  double max_time_difference = 0.02;  ///< seconds, in (0, 1]: poses farther apart are not paired
  bool interpolate = false;           ///< compare with the truth interpolated to the time of the estimate
  double max_truth_gap = 0.2;         ///< seconds, > 0: no interpolation across longer gaps

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct PosePair {
  StampedPose truth;
  StampedPose estimate;
};

/// Associates the poses of two trajectories by time; pairs are in time order, and so must both trajectories
/// be. Without interpolation the pairs closest in time are made first and each pose is used once, so that an
/// estimate at a higher rate than the truth does not count one true pose twice.
std::vector<PosePair> associate(const Trajectory& truth, const Trajectory& estimate,
                                const AssociationOptions& options);

}  // namespace roslam::evaluation
