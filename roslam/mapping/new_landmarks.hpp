// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "roslam/estimation/measurement_model.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/mapping/mapping_options.hpp"
#include "roslam/matching/projection_matcher.hpp"

namespace roslam {

/// Creates a landmark for every static point of the keyframe that has none and whose depth is precise enough.
std::vector<LandmarkId> landmarks_from_depth(Map& map, KeyframeId keyframe, const Camera& camera,
                                             const MeasurementNoise& noise,
                                             const NewLandmarkOptions& options);

/// Triangulates landmarks from points that match in a covisible keyframe, given enough parallax; for points
/// without usable depth. The map's mutex is held for a neighbour at a time, and not while descriptors are
/// compared.
std::vector<LandmarkId> landmarks_from_triangulation(Map& map, MapMutex& mutex, KeyframeId keyframe,
                                                     const Camera& camera, const MeasurementNoise& noise,
                                                     const MatcherOptions& matcher,
                                                     const NewLandmarkOptions& options);

/// Midpoint of the shortest segment between two rays (one frame, directions of any length); nothing if they
/// are parallel.
std::optional<Eigen::Vector3d> triangulate(const Eigen::Vector3d& origin_a,
                                           const Eigen::Vector3d& direction_a,
                                           const Eigen::Vector3d& origin_b,
                                           const Eigen::Vector3d& direction_b);

}  // namespace roslam
