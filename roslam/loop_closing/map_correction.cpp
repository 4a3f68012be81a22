// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop_closing/map_correction.hpp"

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
    while (known != positions.end() && known->landmark < id) ++known;
    if (landmark == nullptr) continue;
    // It moves with its oldest observer: a later one may lie on the other side of the loop.
    const SE3& motion = T_new_old[landmark->observations.front().keyframe.index()];
    const bool is_known = known != positions.end() && known->landmark == id;
    // What local bundle adjustment moved since the snapshot keeps that motion, as its keyframes do.
    landmark->position =
        is_known ? Eigen::Vector3d(known->after + motion.rotation() * (landmark->position - known->before))
                 : motion * landmark->position;
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
  // Not covisible with any of the snapshot: the last one before it in its submap, if there is one.
  for (auto before = T_old_new.upper_bound(keyframe.id); before != T_old_new.begin();) {
    --before;
    const Keyframe* earlier = map.find(before->first);
    if (earlier != nullptr && earlier->submap == keyframe.submap) return before->second;
  }
  return {};
}

}  // namespace roslam
