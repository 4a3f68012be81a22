// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/map_io/merge_maps.hpp"

#include <algorithm>

#include "roslam/common/error.hpp"
#include "roslam/map/map_mutex.hpp"

namespace roslam {

SavedMap merge_maps(const SavedMap& first, const SavedMap& second,
                    std::shared_ptr<const Vocabulary> vocabulary, LoopCloser::Settings settings,
                    const std::function<void(std::size_t)>& progress) {
  second.require_fits(first.camera, first.map.scales());
  KeyframeDatabase database(std::move(vocabulary));
  first.index(database);
  Map map({first.map.scales().begin(), first.map.scales().end()});
  map.append(first.map);
  const auto begin = static_cast<std::uint32_t>(map.keyframe_slots());
  map.append(second.map);

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
  settings.closer.bundle_iterations = bundle_iterations;
  LoopCloser(first.camera, map, database, mutex, settings).adjust_all();
  SavedMap merged = SavedMap::of(first.camera, map, &database);
  merged.name = first.name + " and " + second.name;
  return merged;
}

}  // namespace roslam
