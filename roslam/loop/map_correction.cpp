// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop/map_correction.hpp"

#include <vector>

namespace roslam {

void MapCorrection::apply_to(Map& map) const {
  if (T_old_new.empty()) return;
  std::vector<SE3> T_new_old(map.keyframe_slots());
  for (const KeyframeId id : map.keyframe_ids()) {
    T_new_old[id.index()] = motion_for(map, *map.find(id)).inverse();
  }
  for (const LandmarkId id : map.landmark_ids()) {
    Landmark& landmark = *map.find(id);
    // The first to see it knows it best: what came later may lie on the other side of the loop.
    const SE3& motion = T_new_old[landmark.observations.front().keyframe.index()];
    const auto known = positions.find(id);
    landmark.position = known != positions.end() ? known->second : motion * landmark.position;
    landmark.normal = motion.rotation() * landmark.normal;
  }
  for (const KeyframeId id : map.keyframe_ids()) {
    Keyframe& keyframe = *map.find(id);
    keyframe.T_camera_world = keyframe.T_camera_world * T_new_old[id.index()].inverse();
  }
  map.note_correction();
}

SE3 MapCorrection::motion_for(const Map& map, const Keyframe& keyframe) const {
  const auto own = T_old_new.find(keyframe.id);
  if (own != T_old_new.end()) return own->second;
  for (const auto& [neighbour, shared] : map.covisible(keyframe.id)) {
    const auto theirs = T_old_new.find(neighbour);
    if (theirs != T_old_new.end()) return theirs->second;
  }
  // Sees nothing that older keyframes see: the one before it in time, if there is one in its world.
  for (auto before = T_old_new.upper_bound(keyframe.id); before != T_old_new.begin();) {
    --before;
    const Keyframe* earlier = map.find(before->first);
    if (earlier != nullptr && earlier->world == keyframe.world) return before->second;
  }
  return {};
}

}  // namespace roslam
