// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <map>
#include <utility>
#include <vector>

#include "roslam/map/map.hpp"

namespace roslam {

/// The correction of a map after a loop closure or global bundle adjustment. It is computed on a snapshot
/// while the map keeps growing, then applied to the map as it is by then.
struct MapCorrection {
  /// By keyframe of the snapshot: maps corrected world coordinates to those before, in which that keyframe
  /// was posed: T_camera_new = T_camera_old * T_old_new.
  std::map<KeyframeId, SE3> T_old_new;

  /// Positions (world frame, metres) of landmarks of the snapshot before and after the correction, by
  /// ascending id; all others move rigidly with the oldest keyframe that sees them.
  struct LandmarkCorrection {
    LandmarkId landmark;
    Eigen::Vector3d before;
    Eigen::Vector3d after;
  };
  std::vector<LandmarkCorrection> positions;

  /// Corrects the map that the snapshot was taken of. Keyframes created since move with the most covisible
  /// one of the snapshot; keyframes and landmarks moved since keep that motion. The caller holds the map's
  /// mutex.
  void apply_to(Map& map) const;

 private:
  SE3 motion_for(const Map& map, const Keyframe& keyframe) const;
};

}  // namespace roslam
