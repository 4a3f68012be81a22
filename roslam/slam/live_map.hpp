// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/slam/map_snapshot.hpp"
#include "roslam/slam/trajectory_log.hpp"

namespace roslam {

/// What other threads see of a map that is in use. The map's mutex is held for a millisecond or two at a
/// time.
class LiveMap {
 public:
  /// All must outlive the object.
  LiveMap(const Map& map, MapMutex& mutex, const TrajectoryLog& log) : map_(map), mutex_(mutex), log_(log) {}

  /// Of now, or of a tenth of a second ago at most: readers share it. May be called from any thread.
  std::shared_ptr<const MapSnapshot> snapshot();

  /// Poses of the frames tracked in the main submap. May be called from any thread.
  Trajectory trajectory() const { return path({}); }

  /// How the keyframes changed since the last call. The caller holds the map's mutex.
  MapChange change(MapChangeKind kind);

 private:
  Trajectory path(std::optional<SubmapId> submap) const;
  void copy_keyframes(MapSnapshot& snapshot) const;
  void copy_landmarks(MapSnapshot& snapshot) const;

  const Map& map_;
  MapMutex& mutex_;
  const TrajectoryLog& log_;
  std::mutex snapshot_mutex_;  // guards the next two
  std::shared_ptr<const MapSnapshot> snapshot_;
  std::chrono::steady_clock::time_point taken_;
  std::vector<std::optional<PlacedKeyframe>> known_;  // by id; guarded by the map's mutex
};

}  // namespace roslam
