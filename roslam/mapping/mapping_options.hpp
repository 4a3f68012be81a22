// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

struct ROSLAM_EXPORT NewLandmarkOptions {
  double max_relative_depth_sigma = 0.2;  ///< sigma over depth up to which a landmark is created from depth
  int neighbours = 5;                     ///< keyframes searched for matches of points without depth
  double min_parallax = 1.0;              ///< degrees between the two rays a landmark is triangulated from
  int min_shared = 15;                    ///< landmarks a neighbour must share

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct ROSLAM_EXPORT FusionOptions {
  int neighbours = 10;        ///< covisible keyframes whose landmarks are compared
  int second_neighbours = 5;  ///< covisible keyframes of each of the first five of these

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct ROSLAM_EXPORT CullingOptions {
  double min_found_ratio = 0.25;  ///< times_found over times_visible that a new landmark needs
  int probation = 3;              ///< keyframes a landmark is watched for
  int min_observations = 3;       ///< keyframes that must see it once its probation ends (2 while it lasts)
  double redundant_share = 0.9;   ///< share of landmarks that others see, from which it is removed
  int redundant_views = 3;        ///< other keyframes that must see each of them
  int keep_newest = 3;            ///< newest keyframes that are never removed

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct ROSLAM_EXPORT BundleAdjustmentOptions {
  int iterations = 6;   ///< Levenberg-Marquardt steps at most
  int window = 10;      ///< keyframes optimised by local bundle adjustment; others are fixed
  int min_shared = 15;  ///< landmarks a keyframe must share with the newest one to be optimised

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
