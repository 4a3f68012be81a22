// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/live_map.hpp"

#include <algorithm>

namespace roslam {

namespace {
constexpr const char* kPurpose = "snapshot for readers";
constexpr std::size_t kKeyframesPerLock = 1000;
constexpr std::size_t kLandmarksPerLock = 10000;
constexpr std::size_t kFramesPerLock = 10000;

PlacedKeyframe placed(const Keyframe& keyframe) {
  return {keyframe.id, keyframe.submap, keyframe.timestamp, keyframe.T_camera_world.inverse()};
}

bool is_same(const PlacedKeyframe& a, const PlacedKeyframe& b) {
  return a.submap == b.submap && a.T_world_camera == b.T_world_camera;
}
}  // namespace

std::string_view name_of(MapChangeKind kind) {
  switch (kind) {
    case MapChangeKind::kKeyframe:
      return "keyframe";
    case MapChangeKind::kCorrection:
      return "correction";
    case MapChangeKind::kLevelled:
      return "levelled";
    case MapChangeKind::kWithdrawn:
      return "withdrawn";
  }
  return "unknown";
}

std::shared_ptr<const MapSnapshot> LiveMap::snapshot() {
  constexpr auto kFresh = std::chrono::milliseconds(100);
  const std::scoped_lock lock(snapshot_mutex_);
  if (snapshot_ && std::chrono::steady_clock::now() - taken_ < kFresh) return snapshot_;
  // Parts before and after a correction of the whole map do not fit together.
  constexpr int kTries = 3;
  std::shared_ptr<MapSnapshot> next;
  for (int i = 0; i < kTries; ++i) {
    next = std::make_shared<MapSnapshot>();
    {
      const MapLock map_lock(mutex_, kPurpose);
      next->frames = log_.frames();
      next->corrections = map_.corrections();
      next->main_submap = log_.main_submap(map_);
    }
    copy_keyframes(*next);
    copy_landmarks(*next);
    next->path = path(next->main_submap);
    const MapLock map_lock(mutex_, kPurpose);
    if (map_.corrections() == next->corrections) break;
  }
  snapshot_ = std::move(next);
  taken_ = std::chrono::steady_clock::now();
  return snapshot_;
}

void LiveMap::copy_keyframes(MapSnapshot& snapshot) const {
  for (std::size_t begin = 0;; begin += kKeyframesPerLock) {
    const MapLock lock(mutex_, kPurpose);
    if (begin >= map_.keyframe_slots()) return;
    for (std::size_t i = begin; i < std::min(begin + kKeyframesPerLock, map_.keyframe_slots()); ++i) {
      const Keyframe* keyframe = map_.find(KeyframeId{static_cast<std::uint32_t>(i)});
      if (keyframe != nullptr && !map_.is_withdrawn(keyframe->id))
        snapshot.keyframes.push_back(placed(*keyframe));
    }
  }
}

void LiveMap::copy_landmarks(MapSnapshot& snapshot) const {
  for (std::size_t begin = 0;; begin += kLandmarksPerLock) {
    const MapLock lock(mutex_, kPurpose);
    if (begin >= map_.landmark_slots()) return;
    for (std::size_t i = begin; i < std::min(begin + kLandmarksPerLock, map_.landmark_slots()); ++i) {
      const Landmark* landmark = map_.find(LandmarkId{static_cast<std::uint32_t>(i)});
      if (landmark == nullptr) continue;
      snapshot.landmarks.push_back(
          {landmark->id, map_.submap_of(*landmark), landmark->position.cast<float>(), landmark->colour});
    }
  }
}

// submap: nothing for the main one.
Trajectory LiveMap::path(std::optional<SubmapId> submap) const {
  std::vector<KeyframePose> keyframes;
  std::size_t frames = 0;
  {
    const MapLock lock(mutex_, kPurpose);
    keyframes = TrajectoryLog::keyframe_poses(map_);
    frames = log_.frames();
    if (!submap) submap = log_.main_submap(map_);
  }
  std::vector<TrajectoryLog::Record> records;
  records.reserve(frames);
  for (std::size_t begin = 0; begin < frames; begin += kFramesPerLock) {
    const MapLock lock(mutex_, kPurpose);
    log_.copy(begin, std::min(begin + kFramesPerLock, frames), records);
  }
  return TrajectoryLog::placed(records, keyframes, *submap);
}

MapChange LiveMap::change(MapChangeKind kind) {
  MapChange change;
  change.kind = kind;
  known_.resize(map_.keyframe_slots());
  for (std::uint32_t i = 0; i < known_.size(); ++i) {
    const Keyframe* keyframe = map_.find(KeyframeId{i});
    if (keyframe == nullptr || map_.is_withdrawn(KeyframeId{i})) {
      if (known_[i]) change.removed.push_back(KeyframeId{i});
      known_[i].reset();
      continue;
    }
    const PlacedKeyframe now = placed(*keyframe);
    if (known_[i] && is_same(*known_[i], now)) continue;
    known_[i] = now;
    change.moved.push_back(now);
  }
  return change;
}

}  // namespace roslam
