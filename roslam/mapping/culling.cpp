// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/mapping/culling.hpp"

#include "roslam/error.hpp"

namespace roslam {

namespace {
// True if enough other keyframes see the landmark at the same or a finer pyramid level (one coarser is
// tolerated).
bool is_well_seen(const Map& map, const Landmark& landmark, KeyframeId by, int level, int needed) {
  int views = 0;
  for (const auto& observation : landmark.observations) {
    if (observation.keyframe == by) continue;
    const Keyframe& other = *map.find(observation.keyframe);
    if (other.view->levels[observation.point] <= level + 1 && ++views >= needed) return true;
  }
  return false;
}

bool is_redundant(const Map& map, const Keyframe& keyframe, const CullingOptions& options) {
  int landmarks = 0;
  int well_seen = 0;
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const Landmark* landmark = map.find(keyframe.landmarks[i]);
    if (landmark == nullptr) continue;
    ++landmarks;
    if (is_well_seen(map, *landmark, keyframe.id, keyframe.view->levels[i], options.redundant_views))
      ++well_seen;
  }
  return well_seen > options.redundant_share * landmarks;
}
}  // namespace

void CullingOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("culling.") + message);
  };
  require(min_found_ratio >= 0.0 && min_found_ratio <= 1.0, "min_found_ratio must be 0 to 1");
  require(probation >= 1, "probation must be at least 1 keyframe");
  require(min_observations >= 1, "min_observations must be at least 1");
  require(redundant_share > 0.0 && redundant_share <= 1.0, "redundant_share must be above 0 and at most 1");
  require(redundant_views >= 1, "redundant_views must be at least 1");
  require(keep_newest >= 1, "keep_newest must be at least 1");
}

void LandmarkCuller::watch(const std::vector<LandmarkId>& landmarks) {
  watched_.insert(watched_.end(), landmarks.begin(), landmarks.end());
}

int LandmarkCuller::cull(Map& map, KeyframeId newest) {
  int removed = 0;
  std::deque<LandmarkId> still_watched;
  for (const LandmarkId id : watched_) {
    const Landmark* landmark = map.find(id);
    if (landmark == nullptr) continue;
    const auto age = static_cast<int>(newest.value - landmark->created_by.value);
    const auto views = static_cast<int>(landmark->observations.size());
    const int needed = age < options_.probation ? 2 : options_.min_observations;
    if (landmark->found < options_.min_found_ratio * landmark->predicted || (age >= 2 && views < needed)) {
      map.remove_landmark(id);
      ++removed;
    } else if (age < options_.probation) {
      still_watched.push_back(id);
    }
  }
  watched_ = std::move(still_watched);
  return removed;
}

int cull_keyframes(Map& map, KeyframeId newest, const CullingOptions& options) {
  int removed = 0;
  for (const auto& [id, shared] : map.covisible(newest)) {
    const bool is_protected =
        id.value == 0 || id.value + static_cast<std::uint32_t>(options.keep_newest) > newest.value;
    const Keyframe* keyframe = map.find(id);
    if (is_protected || keyframe == nullptr || !is_redundant(map, *keyframe, options)) continue;
    const auto neighbours = map.covisible(id);
    map.remove_keyframe(id, neighbours.front().first);
    ++removed;
  }
  return removed;
}

}  // namespace roslam
