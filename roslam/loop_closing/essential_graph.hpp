// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "roslam/loop_closing/map_correction.hpp"
#include "roslam/loop_closing/pose_graph.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"

namespace roslam {

/// The keyframes of a map and their strongest constraints: a spanning tree (each to the earlier one that
/// shares most landmarks), pairs that share many, and loops (Mur-Artal and Tardos, T-RO 2017, section III).
struct EssentialGraph {
  PoseGraph graph;
  std::vector<KeyframeId> keyframes;  ///< of each node

  /// The first keyframe of each submap is fixed. min_shared: landmarks that make a pair. closing: a loop that
  /// is not in the map yet; it becomes the last edge. Nothing if one of its keyframes was removed. Takes the
  /// mutex for a few milliseconds at a time.
  static std::optional<EssentialGraph> of(const Map& map, MapMutex& map_mutex, int min_shared,
                                          const LoopClosure& closing);

  /// The correction that moves the map's keyframes to the poses of the graph; before: the graph as it was
  /// built.
  MapCorrection correction(const PoseGraph& before) const;
};

}  // namespace roslam
