// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <map>
#include <utility>
#include <vector>

#include "roslam/map/map.hpp"

namespace roslam {

/// How a map is to change after a loop: worked out on a snapshot while the map goes on growing, then carried
/// over to what it has become.
struct MapCorrection {
  /// By keyframe of the snapshot: maps the corrected world to the world as that keyframe had it.
  std::map<KeyframeId, SE3> T_old_new;

  /// Of landmarks of the snapshot whose new position is known, by ascending id; all others move along with a
  /// keyframe that sees them.
  std::vector<std::pair<LandmarkId, Eigen::Vector3d>> positions;

  /// Corrects a map of which the snapshot was taken: keyframes that came since move along with the one of
  /// their world that shares most with them, keyframes that moved since keep that motion.
  void apply_to(Map& map) const;

 private:
  SE3 motion_for(const Map& map, const Keyframe& keyframe) const;
};

}  // namespace roslam
