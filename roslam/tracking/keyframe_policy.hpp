// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "roslam/map/map.hpp"
#include "roslam/tracking/tracker.hpp"

namespace roslam {

struct KeyframePolicyOptions {
  bool enabled = true;         ///< false: no frame becomes a keyframe, the map stays as it is
  double max_interval = 1.0;   ///< seconds after which a keyframe is taken if the mapper is idle
  double min_interval = 0.0;   ///< seconds between keyframes at least
  double min_overlap = 0.6;    ///< share of the reference keyframe's landmarks below which a new one is due
  int min_tracked_near = 100;  ///< with fewer near landmarks tracked, and many near points unused, one is due
  int min_new_near = 70;       ///< near points without a landmark that make a keyframe worth it
  double near = 3.0;           ///< metres; what is nearer counts as near

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Decides which frames become keyframes.
class KeyframePolicy {
 public:
  /// Throws OptionsError.
  explicit KeyframePolicy(const KeyframePolicyOptions& options);

  /// True if the frame should become a keyframe. mapper_idle: the mapper could start on it at once.
  bool promotes(const TrackedFrame& frame, const Map& map, bool mapper_idle) const;

  /// Tells that the frame became a keyframe.
  void promoted(const TrackedFrame& frame) { last_timestamp_ = frame.timestamp; }

 private:
  KeyframePolicyOptions options_;
  double last_timestamp_ = 0.0;
};

}  // namespace roslam
