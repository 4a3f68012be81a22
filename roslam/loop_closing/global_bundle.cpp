// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop_closing/global_bundle.hpp"

#include <algorithm>

namespace roslam {

namespace {
constexpr std::size_t kPerLock = 500;  // landmarks read under one lock
}

GlobalBundle GlobalBundle::of(const Map& map, MapMutex& map_mutex, const MeasurementNoise& noise) {
  GlobalBundle result;
  std::vector<std::size_t> pose_of;
  std::vector<LandmarkId> candidates;
  {
    const MapLock lock(map_mutex, "reading for global bundle adjustment");
    pose_of.resize(map.keyframe_slots());
    const std::set<KeyframeId> origins = map.origins();
    for (const KeyframeId id : map.keyframe_ids()) {
      pose_of[id.index()] = result.keyframes.size();
      result.problem.poses.push_back({map.find(id)->T_camera_world, origins.count(id) > 0});
      result.keyframes.push_back(id);
    }
    candidates = map.landmark_ids();
  }
  std::vector<bool> is_in(pose_of.size(), false);
  for (const KeyframeId id : result.keyframes) is_in[id.index()] = true;
  // Of one batch; appended to the problem without the lock, as that may reallocate.
  std::vector<BundleProblem::Term> terms;
  for (std::size_t begin = 0; begin < candidates.size(); begin += kPerLock) {
    result.problem.terms.insert(result.problem.terms.end(), terms.begin(), terms.end());
    terms.clear();
    const MapLock lock(map_mutex, "reading for global bundle adjustment");
    for (std::size_t i = begin; i < std::min(begin + kPerLock, candidates.size()); ++i) {
      const Landmark* landmark = map.find(candidates[i]);
      if (landmark == nullptr) continue;
      const std::size_t first = terms.size();
      for (const auto& observation : landmark->observations) {
        const std::size_t k = observation.keyframe.index();
        if (k >= is_in.size() || !is_in[k]) continue;  // created since
        const ObservedFrame& view = *map.find(observation.keyframe)->view;
        terms.push_back(
            {pose_of[k], result.landmarks.size(), map.measurement(view, observation.point, noise)});
      }
      // A landmark seen once does not constrain the poses.
      if (terms.size() < first + 2) {
        terms.resize(first);
        continue;
      }
      result.problem.points.push_back(landmark->position);
      result.landmarks.push_back(candidates[i]);
    }
  }
  result.problem.terms.insert(result.problem.terms.end(), terms.begin(), terms.end());
  return result;
}

MapCorrection GlobalBundle::correction(const BundleProblem& before) const {
  MapCorrection result;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    result.T_old_new[keyframes[i]] =
        before.poses[i].T_camera_world.inverse() * problem.poses[i].T_camera_world;
  }
  for (std::size_t p = 0; p < landmarks.size(); ++p) {
    result.positions.push_back({landmarks[p], before.points[p], problem.points[p]});
  }
  return result;
}

}  // namespace roslam
