// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/dense/surface_map.hpp"

namespace roslam {

class OccupancyMap;

/// The dense map of a session, with statistics.
struct ROSLAM_EXPORT DenseMap {
  SurfaceMap surface;                 ///< world frame of the submap
  std::vector<SurfacePoint> removed;  ///< points on dynamic objects, as keyframes saw them; without normals
  std::shared_ptr<const OccupancyMap> occupancy;  ///< null if there are no surfaces
  double voxel_size = 0.0;                        ///< metres; 0: no keyframe had depth
  int times_coarsened = 0;    ///< by a factor of two each, to stay within DenseOptions::max_memory
  std::size_t keyframes = 0;  ///< that were fused
  std::size_t dropped = 0;    ///< keyframes dropped in real-time mode
  std::size_t moved = 0;      ///< re-integrations of keyframes whose pose was corrected
  std::size_t voxel_bytes = 0, view_bytes = 0;
  std::map<std::string, std::size_t> faults;  ///< failures that cost a keyframe, by message
};

/// Why a map without surfaces has none, in words.
inline std::string_view why_empty(const DenseMap& map) {
  if (map.keyframes > 0) return "nothing within dense.max_depth was seen often enough";
  if (map.dropped > 0 || !map.faults.empty()) return "all keyframes were dropped or failed";
  return "no keyframe has depth within dense.max_depth";
}

}  // namespace roslam
