// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

struct ROSLAM_EXPORT MatcherOptions {
  int max_distance = 100;        ///< bits, for searches around a predicted pixel
  int strict_distance = 50;      ///< bits, for searches over whole images and for fusion
  double ratio = 0.8;            ///< best to second best distance; around a predicted pixel only on one level
  double frame_radius = 7.0;     ///< pixels at the finest level, search from the last frame
  double map_radius = 3.0;       ///< pixels at the finest level, search for landmarks of the local map
  double fuse_radius = 3.0;      ///< pixels at the finest level, search for duplicate landmarks
  double depth_tolerance = 0.1;  ///< fraction of the depth by which a match may differ

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
