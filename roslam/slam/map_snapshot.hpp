// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <opencv2/core.hpp>
#include <string_view>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/map/ids.hpp"

namespace roslam {

/// Where a keyframe is.
struct ROSLAM_EXPORT PlacedKeyframe {
  KeyframeId id;
  SubmapId submap;
  double timestamp = 0.0;  ///< seconds
  SE3 T_world_camera;      ///< in the world frame of its submap
};

/// Where a landmark is.
struct ROSLAM_EXPORT PlacedLandmark {
  LandmarkId id;
  SubmapId submap;
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< world frame of its submap, metres
  cv::Vec3b colour;                                    ///< BGR
};

/// The sparse map at one time of the flight, for displays and planners. Immutable.
struct ROSLAM_EXPORT MapSnapshot {
  std::size_t frames = 0;       ///< used until then
  std::size_t corrections = 0;  ///< loops, merged submaps and the like until then
  SubmapId main_submap;
  std::vector<PlacedKeyframe> keyframes;  ///< of all submaps, by ascending id
  std::vector<PlacedLandmark> landmarks;  ///< likewise
  Trajectory path;                        ///< as Slam::trajectory()
};

/// What changed the map.
enum class MapChangeKind {
  kKeyframe,    ///< a keyframe was added and its surroundings adjusted
  kCorrection,  ///< a loop was closed, submaps were merged, or all was adjusted
  kLevelled,    ///< the world was turned against gravity
  kWithdrawn,   ///< keyframes of wrong poses were removed
};

/// In words, for messages.
ROSLAM_EXPORT std::string_view name_of(MapChangeKind kind);

/// How the map changed.
struct ROSLAM_EXPORT MapChange {
  MapChangeKind kind = MapChangeKind::kKeyframe;
  std::vector<PlacedKeyframe> moved;  ///< keyframes that are new or whose pose or submap changed
  std::vector<KeyframeId> removed;
};

}  // namespace roslam
