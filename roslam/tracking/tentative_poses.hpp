// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "roslam/geometry/se3.hpp"
#include "roslam/map/map.hpp"
#include "roslam/tracking/tracked_frame.hpp"

namespace roslam {

/// A tracked frame as the next one is tracked from it.
struct TrackedState {
  TrackedFrame frame;
  SE3 T_camera_reference;            ///< its pose in its reference keyframe, which the map may correct
  std::optional<Vector6d> velocity;  ///< twist of T_current_last, per second; nothing: unknown

  /// World positions of the frame's landmarks when it was tracked; of none: zero.
  std::vector<Eigen::Vector3d> positions = {};

  /// Following later corrections of the map; nothing before the first frame.
  std::optional<SE3> T_camera_world(const Map& map) const {
    if (!frame.reference.is_valid()) return frame.T_camera_world;
    return T_camera_reference * map.T_camera_world(frame.reference);
  }
};

/// Tracked poses that few landmarks support are tentative for half a second: they stay unless what follows
/// contradicts them. Keeps the last pose before them, from which tracking resumes if they are withdrawn. Not
/// thread safe.
class TentativePoses {
 public:
  /// A frame that was tracked. is_strong: its pose is not tentative, and neither are those before it any
  /// more.
  void add(const TrackedState& state, bool is_strong);

  /// To be called when the frame added last became a keyframe.
  void add_keyframe(KeyframeId keyframe);

  /// The last pose before tentative ones; nothing if there are none at that time (seconds).
  const TrackedState* confirmed(double timestamp) const;

  /// True for a keyframe made of a tentative pose.
  bool made(KeyframeId keyframe) const {
    return std::find(keyframes_.begin(), keyframes_.end(), keyframe) != keyframes_.end();
  }

  const std::vector<KeyframeId>& keyframes() const { return keyframes_; }  ///< made of tentative poses

  /// Withdraws what is tentative. Only if there is something.
  Withdrawal withdraw();

  /// Forgets all, as when a new submap begins.
  void restart();

 private:
  std::optional<TrackedState> confirmed_;
  bool has_tentative_ = false;  // poses since
  std::vector<KeyframeId> keyframes_;
};

}  // namespace roslam
