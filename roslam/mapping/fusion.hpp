// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/estimation/measurement_model.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/mapping/mapping_options.hpp"
#include "roslam/matching/projection_matcher.hpp"

namespace roslam {

/// Fuses duplicate landmarks: projects those of a keyframe into its neighbours and theirs into it. If the
/// matched point shows another landmark, the two are merged; if it shows none, an observation is added.
/// Returns how many were merged. The map's mutex is held for a keyframe at a time.
int fuse_landmarks(Map& map, MapMutex& mutex, KeyframeId keyframe, const Camera& camera,
                   const MeasurementNoise& noise, const MatcherOptions& matcher,
                   const FusionOptions& options);

}  // namespace roslam
