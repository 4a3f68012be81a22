// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/map/map.hpp"
#include "roslam/tracking/projection_matcher.hpp"

namespace roslam {

struct FusionOptions {
  int neighbours = 10;        ///< covisible keyframes whose landmarks are compared
  int second_neighbours = 5;  ///< theirs

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Projects the landmarks of a keyframe into its neighbours and theirs into it. Where the point found shows
/// another landmark, the two are merged; where it shows none, an observation is added. Returns how many were
/// merged.
int fuse_landmarks(Map& map, KeyframeId keyframe, const Camera& camera, const MeasurementNoise& noise,
                   const MatcherOptions& matcher, const FusionOptions& options);

}  // namespace roslam
