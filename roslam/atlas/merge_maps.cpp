// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/atlas/merge_maps.hpp"

#include <algorithm>

#include "roslam/error.hpp"
#include "roslam/map/map_mutex.hpp"

namespace roslam {

SavedMap merge_maps(const SavedMap& first, const SavedMap& second,
                    std::shared_ptr<const Vocabulary> vocabulary, LoopCloser::Settings settings,
                    const std::function<void(std::size_t)>& progress) {
  second.require_fits(first.camera, first.map.scales());
  PlaceIndex places(std::move(vocabulary));
  first.index(places);
  Map map({first.map.scales().begin(), first.map.scales().end()});
  map.append(first.map);
  const auto begin = static_cast<std::uint32_t>(map.keyframe_slots());
  map.append(second.map);

  // Once for all loops is enough.
  const int bundle_iterations = std::exchange(settings.closer.bundle_iterations, 0);
  MapMutex nobody_else;
  LoopCloser closer(first.camera, map, places, nobody_else, settings);
  for (std::uint32_t i = begin; i < map.keyframe_slots(); ++i) {
    closer.process(KeyframeId{i});
    if (progress) progress(i - begin + 1);
  }
  const bool have_met =
      std::any_of(closer.closed().begin(), closer.closed().end(),
                  [&](const ClosedLoop& loop) { return loop.joins && loop.place.value < begin; });
  if (!have_met) {
    throw InputError(first.name + " and " + second.name + ": no place of one is recognised in the other; " +
                     "merge maps that overlap, seen from about the same side");
  }
  settings.closer.bundle_iterations = bundle_iterations;
  LoopCloser(first.camera, map, places, nobody_else, settings).adjust_all();
  SavedMap merged = SavedMap::of(first.camera, map, &places);
  merged.name = first.name + " and " + second.name;
  return merged;
}

}  // namespace roslam
