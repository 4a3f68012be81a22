// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/mapping/fusion.hpp"

#include <algorithm>

#include "roslam/common/error.hpp"
#include "roslam/mapping/landmark_fit.hpp"

namespace roslam {

namespace {
// The covisible keyframes and theirs, each once.
std::vector<KeyframeId> neighbourhood(const Map& map, KeyframeId id, const FusionOptions& options) {
  std::vector<KeyframeId> result;
  const auto add = [&](KeyframeId candidate) {
    if (candidate != id && std::find(result.begin(), result.end(), candidate) == result.end()) {
      result.push_back(candidate);
    }
  };
  const auto first = map.covisible(id);
  for (std::size_t i = 0; i < first.size() && i < static_cast<std::size_t>(options.neighbours); ++i) {
    add(first[i].first);
  }
  const std::size_t direct = result.size();
  for (std::size_t i = 0; i < direct && i < 5; ++i) {
    const auto second = map.covisible(result[i]);
    for (std::size_t k = 0; k < second.size() && k < static_cast<std::size_t>(options.second_neighbours);
         ++k) {
      add(second[k].first);
    }
  }
  return result;
}

std::vector<LandmarkId> landmarks_of(const Keyframe& keyframe) {
  std::vector<LandmarkId> result;
  std::copy_if(keyframe.landmarks.begin(), keyframe.landmarks.end(), std::back_inserter(result),
               [](LandmarkId id) { return id.is_valid(); });
  return result;
}

class Fuser {
 public:
  Fuser(Map& map, const Camera& camera, const MeasurementNoise& noise, const MatcherOptions& options)
      : map_(map), camera_(camera), noise_(noise), matcher_(options) {}

  int fuse_into(KeyframeId keyframe_id, const std::vector<LandmarkId>& landmarks) {
    const Keyframe& keyframe = *map_.find(keyframe_id);
    const ObservedFrame& view = *keyframe.view;
    const std::vector<LandmarkId> none_taken(view.size());
    int merged = 0;
    for (const LandmarkId id : landmarks) {
      const Landmark* landmark = map_.find(id);
      if (landmark == nullptr || sees(keyframe_id, *landmark)) continue;
      const auto predicted = predict(*landmark, map_, view, camera_, keyframe.T_camera_world);
      if (!predicted) continue;
      const float radius = static_cast<float>(matcher_.options().fuse_radius) * map_.scale(predicted->level);
      const int match = matcher_.find({predicted->pixel, radius, predicted->level - 1, predicted->level,
                                       predicted->depth, matcher_.options().strict_distance, false},
                                      landmark->descriptor, view, none_taken);
      if (match < 0) continue;
      const auto point = static_cast<std::uint32_t>(match);
      if (view.may_move(point) ||
          !is_within_outlier_limit(map_, keyframe, point, landmark->position, camera_, noise_))
        continue;
      merged += add_or_merge(id, keyframe_id, point) ? 1 : 0;
    }
    return merged;
  }

 private:
  static bool sees(KeyframeId keyframe, const Landmark& landmark) {
    return std::any_of(landmark.observations.begin(), landmark.observations.end(),
                       [&](const Observation& o) { return o.keyframe == keyframe; });
  }

  // True if two landmarks were merged.
  bool add_or_merge(LandmarkId id, KeyframeId keyframe_id, std::uint32_t point) {
    const LandmarkId other = map_.find(keyframe_id)->landmarks[point];
    if (!other.is_valid()) {
      map_.add_observation(id, keyframe_id, point);
      map_.refresh(id);
      return false;
    }
    const bool other_is_stronger = map_.find(other)->observations.size() > map_.find(id)->observations.size();
    map_.merge_landmarks(other_is_stronger ? id : other, other_is_stronger ? other : id);
    return true;
  }

  Map& map_;
  const Camera& camera_;
  const MeasurementNoise& noise_;
  ProjectionMatcher matcher_;
};
}  // namespace

void FusionOptions::validate() const {
  if (neighbours < 0) throw OptionsError("fusion.neighbours must not be negative");
  if (second_neighbours < 0) throw OptionsError("fusion.second_neighbours must not be negative");
}

int fuse_landmarks(Map& map, MapMutex& mutex, KeyframeId id, const Camera& camera,
                   const MeasurementNoise& noise, const MatcherOptions& matcher,
                   const FusionOptions& options) {
  constexpr const char* kPurpose = "fusion of landmarks";
  constexpr std::size_t kPerLock = 1000;  // landmarks
  Fuser fuser(map, camera, noise, matcher);
  std::vector<KeyframeId> neighbours;
  {
    const MapLock lock(mutex, kPurpose);
    neighbours = neighbourhood(map, id, options);
  }
  int merged = 0;
  for (const KeyframeId neighbour : neighbours) {
    const MapLock lock(mutex, kPurpose);
    if (map.find(neighbour) == nullptr || map.find(id) == nullptr) continue;
    merged += fuser.fuse_into(neighbour, landmarks_of(*map.find(id)));
  }
  std::vector<LandmarkId> theirs;
  for (const KeyframeId neighbour : neighbours) {
    const MapLock lock(mutex, kPurpose);
    if (map.find(neighbour) == nullptr) continue;
    const auto landmarks = landmarks_of(*map.find(neighbour));
    theirs.insert(theirs.end(), landmarks.begin(), landmarks.end());
  }
  std::sort(theirs.begin(), theirs.end());
  theirs.erase(std::unique(theirs.begin(), theirs.end()), theirs.end());
  for (std::size_t begin = 0; begin < theirs.size(); begin += kPerLock) {
    const MapLock lock(mutex, kPurpose);
    if (map.find(id) == nullptr) break;
    const auto first = theirs.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = theirs.begin() + static_cast<std::ptrdiff_t>(std::min(begin + kPerLock, theirs.size()));
    merged += fuser.fuse_into(id, {first, last});
  }
  return merged;
}

}  // namespace roslam
