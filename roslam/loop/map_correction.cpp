// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop/map_correction.hpp"

#include <vector>

namespace roslam {

void MapCorrection::apply_to(Map& map) const {
  if (T_old_new.empty()) return;
  std::vector<SE3> T_new_old(map.keyframe_slots());
  std::vector<SE3> T_camera_new(map.keyframe_slots());
  for (const KeyframeId id : map.keyframe_ids()) {
    const Keyframe& keyframe = *map.find(id);
    const SE3 motion = motion_for(map, keyframe);
    T_new_old[id.index()] = motion.inverse();
    T_camera_new[id.index()] = keyframe.T_camera_world * motion;
  }
  auto known = positions.begin();
  for (std::uint32_t i = 0; i < map.landmark_slots(); ++i) {
    const LandmarkId id{i};
    Landmark* landmark = map.find(id);
    while (known != positions.end() && known->first < id) ++known;
    if (landmark == nullptr) continue;
    // The first to see it knows it best: what came later may lie on the other side of the loop.
    const SE3& motion = T_new_old[landmark->observations.front().keyframe.index()];
    const bool is_known = known != positions.end() && known->first == id;
    landmark->position = is_known ? known->second : motion * landmark->position;
    landmark->normal = motion.rotation() * landmark->normal;
  }
  for (const KeyframeId id : map.keyframe_ids()) map.find(id)->T_camera_world = T_camera_new[id.index()];
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
