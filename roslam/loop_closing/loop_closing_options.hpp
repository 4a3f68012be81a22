// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

struct ROSLAM_EXPORT LoopDetectorOptions {
  bool enabled = true;            ///< false: no loop is detected or closed
  double min_similarity = 0.25;   ///< of a candidate, as a share of that of the most similar neighbour
  int candidates = 3;             ///< keyframes verified by geometry for one keyframe
  int min_inliers = 60;           ///< landmarks that must agree on the pose
  int min_shared = 15;            ///< landmarks two keyframes share to count as neighbours
  int consistent = 3;             ///< keyframes that must agree on the correction to confirm a loop
  int max_gap = 3;                ///< keyframes from one of these to the next at most
  double tolerance = 0.1;         ///< metres by which their poses may differ
  double angle_tolerance = 0.02;  ///< radians by which their poses may differ
  double max_drift = 0.03;        ///< share of the path length between that a loop may correct
  double max_correction = 10.0;   ///< metres that a loop may correct however long the path

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct ROSLAM_EXPORT LoopCloserOptions {
  int min_shared = 100;        ///< landmarks that make a pair of keyframes an edge of the essential graph
  double max_error = 4.0;      ///< sigmas; a loop with a larger error after the pose graph is refused
  int bundle_iterations = 10;  ///< of global bundle adjustment; 0: none

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct ROSLAM_EXPORT PoseGraphOptions {
  int iterations = 50;              ///< Levenberg-Marquardt steps at most
  double rotation_sigma = 0.005;    ///< radians that a relative pose may be off
  double translation_sigma = 0.02;  ///< metres that a relative pose may be off
  double loop_kernel = 10.0;        ///< sigmas; scale of the Cauchy kernel on loop edges

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
