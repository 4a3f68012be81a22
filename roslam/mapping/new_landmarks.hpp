// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/map/map.hpp"
#include "roslam/tracking/projection_matcher.hpp"

namespace roslam {

struct NewLandmarkOptions {
  double max_relative_depth_sigma =
      0.2;                    ///< share of the depth its noise may be for a landmark to come from depth
  int neighbours = 5;         ///< keyframes searched for a second view of points without depth
  double min_parallax = 1.0;  ///< degrees between two views a landmark is triangulated from
  int min_shared = 15;        ///< landmarks a neighbour must share

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Makes a landmark of every point of the keyframe that has a trusted depth and shows none yet.
std::vector<LandmarkId> landmarks_from_depth(Map& map, KeyframeId keyframe, const Camera& camera,
                                             const MeasurementNoise& noise,
                                             const NewLandmarkOptions& options);

/// Makes landmarks of points without depth that a covisible keyframe sees too, from enough parallax.
std::vector<LandmarkId> landmarks_from_triangulation(Map& map, KeyframeId keyframe, const Camera& camera,
                                                     const MeasurementNoise& noise,
                                                     const MatcherOptions& matcher,
                                                     const NewLandmarkOptions& options);

/// The point nearest to two rays (directions need not be unit vectors; all in one frame); nothing if they are
/// parallel.
std::optional<Eigen::Vector3d> triangulate(const Eigen::Vector3d& origin_a,
                                           const Eigen::Vector3d& direction_a,
                                           const Eigen::Vector3d& origin_b,
                                           const Eigen::Vector3d& direction_b);

}  // namespace roslam
