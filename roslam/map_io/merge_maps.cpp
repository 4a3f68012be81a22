// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/map_io/merge_maps.hpp"

#include <algorithm>
#include <map>

#include "roslam/common/error.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/map/map_parts.hpp"

namespace roslam {

namespace {
// Keyframes of one map with their twins in another: of the same time and features.
std::map<KeyframeId, KeyframeId> twins(const Map& of, const Map& in) {
  std::multimap<double, const Keyframe*> by_time;
  for (const KeyframeId id : in.keyframe_ids()) by_time.emplace(in.find(id)->timestamp, in.find(id));
  std::map<KeyframeId, KeyframeId> result;
  for (const KeyframeId id : of.keyframe_ids()) {
    const ObservedFrame& view = *of.find(id)->view;
    const auto [begin, end] = by_time.equal_range(of.find(id)->timestamp);
    for (auto at = begin; at != end; ++at) {
      const ObservedFrame& other = *at->second->view;
      if (view.pixels == other.pixels && view.descriptors == other.descriptors) result[id] = at->second->id;
    }
  }
  return result;
}

void require_new(const SavedMap& map, const SavedMap& other) {
  if (twins(map.map, other.map).size() == map.map.keyframe_count())
    throw InputError(map.name + ": " + other.name + " contains all of its keyframes; use the latter alone");
}

// Moves the observations of a keyframe to its twin and removes it.
void replace(Map& map, KeyframeId keyframe, KeyframeId twin) {
  for (std::uint32_t point = 0; point < map.find(twin)->landmarks.size(); ++point) {
    const LandmarkId theirs = map.find(keyframe)->landmarks[point], ours = map.find(twin)->landmarks[point];
    ours.is_valid() ? map.merge_landmarks(theirs, ours) : void(map.add_observation(theirs, twin, point));
  }
  map.remove_keyframe(keyframe, twin);
}
}  // namespace

SavedMap merge_maps(const SavedMap& first, const SavedMap& second,
                    std::shared_ptr<const Vocabulary> vocabulary, LoopCloser::Settings settings,
                    const std::function<void(std::size_t)>& progress) {
  second.require_fits(first.camera, first.map.scales());
  require_new(second, first);
  require_new(first, second);
  KeyframeDatabase database(std::move(vocabulary));
  first.index(database);
  Map map({first.map.scales().begin(), first.map.scales().end()});
  map.append(MapParts::of(first.map));
  const auto begin = static_cast<std::uint32_t>(map.keyframe_slots());
  map.append(MapParts::of(second.map));

  // Global bundle adjustment once, after all loops.
  const int bundle_iterations = std::exchange(settings.closer.bundle_iterations, 0);
  MapMutex mutex;
  LoopCloser closer(first.camera, map, database, mutex, settings);
  for (std::uint32_t i = begin; i < map.keyframe_slots(); ++i) {
    closer.process(KeyframeId{i});
    if (progress) progress(i - begin + 1);
  }
  const bool is_connected = std::any_of(
      closer.closed().begin(), closer.closed().end(),
      [&](const ClosedLoop& loop) { return loop.merges_submaps && loop.matched_keyframe.value < begin; });
  if (!is_connected) {
    throw InputError(first.name + " and " + second.name + ": no place of one is recognised in the other; " +
                     "merge maps that overlap, seen from about the same side");
  }
  for (const auto& [theirs, ours] : twins(second.map, first.map)) {
    const KeyframeId keyframe{begin + theirs.value};
    if (map.submap_of(keyframe) == map.submap_of(ours)) replace(map, keyframe, ours);
  }
  settings.closer.bundle_iterations = bundle_iterations;
  LoopCloser(first.camera, map, database, mutex, settings).adjust_all();
  SavedMap merged = SavedMap::of(first.camera, map, &database);
  merged.name = first.name + " and " + second.name;
  return merged;
}

}  // namespace roslam
