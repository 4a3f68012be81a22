// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "roslam/loop/map_correction.hpp"
#include "roslam/loop/pose_graph.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"

namespace roslam {

/// The keyframes of a map and what ties them together most: each to the earlier one that shares most with it,
/// pairs that share many landmarks, and loops (Mur-Artal and Tardos, T-RO 2017, section III).
struct EssentialGraph {
  PoseGraph graph;
  std::vector<KeyframeId> keyframes;  ///< of each node

  /// The first keyframe of each world is fixed. min_shared: landmarks that make a pair. closing: a loop that
  /// is not in the map yet; the last edge. Nothing if one of its keyframes is gone. Takes the mutex for a few
  /// milliseconds at a time.
  static std::optional<EssentialGraph> of(const Map& map, MapMutex& map_mutex, int min_shared,
                                          const LoopClosure& closing);

  /// What has to happen to the map for its keyframes to lie as in the graph; before: the graph as it was
  /// taken.
  MapCorrection correction(const PoseGraph& before) const;
};

}  // namespace roslam
