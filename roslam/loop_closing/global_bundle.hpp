// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "roslam/loop_closing/map_correction.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/mapping/bundle_adjustment.hpp"

namespace roslam {

/// Global bundle adjustment: all keyframes and all landmarks that several of them see.
struct GlobalBundle {
  BundleProblem problem;
  std::vector<KeyframeId> keyframes;  ///< of each pose
  std::vector<LandmarkId> landmarks;  ///< of each point

  /// The first keyframe of each submap is fixed. Takes the mutex for a few milliseconds at a time, so that
  /// the tracker is not blocked.
  static GlobalBundle of(const Map& map, MapMutex& map_mutex, const MeasurementNoise& noise);

  /// The correction that moves the map to the solution; before: the problem as it was built.
  MapCorrection correction(const BundleProblem& before) const;
};

}  // namespace roslam
