// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/resting_points.hpp"

namespace roslam {

std::vector<TemporaryPoint> match_resting_points(const Map& map, const Camera& camera,
                                                 const std::vector<KeyframeId>& keyframes,
                                                 const ObservedFrame& view, const SE3& T_camera_world,
                                                 const std::vector<std::uint32_t>& used,
                                                 ProjectionMatcher& matcher) {
  constexpr float kRadius = 4.0F;  // times matcher.map_radius
  constexpr float kSure = 0.1F;    // of the depth: the point is taken for exact
  constexpr LandmarkId kTaken{LandmarkId::kNone - 1};
  std::vector<LandmarkId> taken(view.size());
  for (const std::uint32_t point : used) taken[point] = kTaken;
  std::vector<TemporaryPoint> result;
  for (const KeyframeId id : keyframes) {
    const Keyframe& keyframe = *map.find(id);
    const ObservedFrame& theirs = *keyframe.view;
    if (theirs.is_movable.empty()) continue;
    const SE3 T_world_keyframe = keyframe.T_camera_world.inverse();
    for (std::uint32_t i = 0; i < theirs.size(); ++i) {
      if (!theirs.may_move(i) || !theirs.has_depth(i, kSure) || keyframe.landmarks[i].is_valid()) continue;
      const Eigen::Vector3d position =
          T_world_keyframe * camera.unproject(theirs.pixels[i].cast<double>(), theirs.depths[i]);
      const Eigen::Vector3d in_camera = T_camera_world * position;
      if (in_camera.z() <= 0.0) continue;
      const Eigen::Vector2f pixel = camera.project(in_camera).cast<float>();
      if (!view.grid.contains(pixel)) continue;
      const auto depth = static_cast<float>(in_camera.z());
      const int level = theirs.levels[i];
      const float radius = kRadius * static_cast<float>(matcher.options().map_radius) * map.scale(level);
      const int match =
          matcher.find({pixel, radius, level - 1, level + 1, depth, matcher.options().max_distance, true},
                       theirs.descriptors[i], view, taken);
      if (match < 0) continue;
      const auto point = static_cast<std::uint32_t>(match);
      taken[point] = kTaken;
      result.push_back({point, position});
    }
  }
  return result;
}

}  // namespace roslam
