// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

struct ROSLAM_EXPORT GeometricVerifierOptions {
  int match_distance = 64;     ///< bits, for searches over the whole image and around landmarks
  double match_ratio = 0.9;    ///< best to second best distance, over the whole image
  int min_matches = 15;        ///< matches with a keyframe required for a pose estimate
  int min_agreeing = 7;        ///< RANSAC inliers required of these
  int iterations = 10000;      ///< RANSAC samples per keyframe, at most; few of them cost P3P
  double max_error = 4.0;      ///< pixels, reprojection error of a RANSAC inlier
  int neighbours = 10;         ///< covisible keyframes whose landmarks are also searched for
  double search_radius = 8.0;  ///< pixels at the finest level, around landmarks projected by the first pose

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
