// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/map/map_parts.hpp"

#include <algorithm>
#include <optional>

namespace roslam {

namespace {
constexpr std::size_t kKeyframeSlice = 50;    // ids looked at each time the mutex is held
constexpr std::size_t kLandmarkSlice = 4000;  // likewise

void lock(std::optional<MapLock>& lock, MapMutex* mutex) {
  if (mutex != nullptr) lock.emplace(*mutex, "copy of the map");
}

void copy_keyframes(const Map& map, std::size_t begin, std::size_t end, const std::set<SubmapId>& without,
                    MapParts& parts) {
  for (std::size_t i = begin; i < end; ++i) {
    const Keyframe* keyframe = map.find(KeyframeId{static_cast<std::uint32_t>(i)});
    if (keyframe != nullptr && !map.is_withdrawn(keyframe->id) && !without.contains(keyframe->submap))
      parts.keyframes.push_back(*keyframe);
  }
}

void copy_landmarks(const Map& map, std::size_t begin, std::size_t end, MapParts& parts) {
  for (std::size_t i = begin; i < end; ++i) {
    const Landmark* landmark = map.find(LandmarkId{static_cast<std::uint32_t>(i)});
    if (landmark == nullptr) continue;
    parts.landmarks.push_back(*landmark);
    parts.landmarks.back().created_by = map.T_camera_anchor(landmark->created_by).first;
  }
}

// Nothing if the map was corrected meanwhile. mutex: null where it is not needed, or held.
std::optional<MapParts> copied(const Map& map, MapMutex* mutex, const std::set<SubmapId>& without) {
  MapParts parts;
  std::size_t corrections = 0;
  std::size_t keyframe_slots = 0;
  {
    std::optional<MapLock> held;
    lock(held, mutex);
    parts.scales.assign(map.scales().begin(), map.scales().end());
    parts.loops = map.loops();
    corrections = map.corrections();
    keyframe_slots = map.keyframe_slots();
  }
  for (std::size_t i = 0; i < keyframe_slots; i += kKeyframeSlice) {
    std::optional<MapLock> held;
    lock(held, mutex);
    if (map.corrections() != corrections) return std::nullopt;
    copy_keyframes(map, i, std::min(i + kKeyframeSlice, keyframe_slots), without, parts);
  }
  for (std::size_t i = 0;; i += kLandmarkSlice) {
    std::optional<MapLock> held;
    lock(held, mutex);
    if (map.corrections() != corrections) return std::nullopt;
    if (i >= map.landmark_slots()) return parts;
    copy_landmarks(map, i, std::min(i + kLandmarkSlice, map.landmark_slots()), parts);
  }
}
}  // namespace

MapParts MapParts::of(const Map& map, const std::set<SubmapId>& without) {
  return *copied(map, nullptr, without);
}

MapParts MapParts::of(const Map& map, MapMutex& mutex, const std::set<SubmapId>& without) {
  constexpr int kTries = 5;
  for (int i = 0; i < kTries; ++i) {
    if (auto parts = copied(map, &mutex, without)) return std::move(*parts);
  }
  const MapLock lock(mutex, "copy of the map");
  return *copied(map, nullptr, without);
}

}  // namespace roslam
