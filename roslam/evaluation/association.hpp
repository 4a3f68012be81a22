// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "roslam/geometry/trajectory.hpp"

namespace roslam {

struct AssociationOptions {
  double max_time_difference = 0.02;  ///< seconds, in (0, 1]: a pair whose times differ by more is none
  bool interpolate = false;           ///< compare with the truth interpolated to the time of the estimate
  double max_truth_gap = 0.2;         ///< seconds, > 0: interpolation bridges no wider hole in the truth

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct PosePair {
  StampedPose truth;
  StampedPose estimate;
};

/// Pairs the poses of two trajectories by time, in the order of time. Without interpolation the pairs closest
/// in time are made first and each pose is used once, so that an estimate at a higher rate than the truth
/// does not count one pose of the truth twice. Both trajectories must be in the order of time.
std::vector<PosePair> associate(const Trajectory& truth, const Trajectory& estimate,
                                const AssociationOptions& options);

}  // namespace roslam
