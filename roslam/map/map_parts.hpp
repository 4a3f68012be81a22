// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <set>
#include <vector>

#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"

namespace roslam {

/// Copies of the elements of a map.
struct MapParts {
  std::vector<float> scales;
  std::vector<Keyframe> keyframes;  ///< by ascending id
  std::vector<Landmark> landmarks;  ///< by ascending id; created_by: an existing keyframe
  std::vector<LoopClosure> loops;

  /// Of a map that nobody else uses. without: submaps that are left out.
  static MapParts of(const Map& map, const std::set<SubmapId>& without = {});

  /// Of a map that others change. The mutex is held for a millisecond or two at a time, as a copy of a large
  /// map at once would keep the tracker waiting. Parts may therefore be of slightly different states, such as
  /// poses and landmarks before and after a local bundle adjustment, but not before and after a correction of
  /// the whole map, which makes the copy begin anew. Map::append() leaves out what does not fit together.
  static MapParts of(const Map& map, MapMutex& mutex, const std::set<SubmapId>& without = {});
};

}  // namespace roslam
