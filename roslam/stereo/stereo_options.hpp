// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

/// Depth from stereo pairs.
struct ROSLAM_EXPORT StereoOptions {
  double min_depth = 0.4;        ///< metres; what is nearer is not searched for, which bounds disparities
  double min_correlation = 0.8;  ///< of patches that may match (zero-mean, normalised)
  double uniqueness = 0.95;      ///< most that a second place along the row may correlate, of the best
  double disparity_sigma = 1.0;  ///< pixels of a feature's pyramid level, the least deviation of a disparity
  bool every_frame = true;   ///< dense depth of each frame where dynamic objects are detected by geometry;
                             ///< false: of keyframes only
  double dense_scale = 0.5;  ///< side of the images that dense depth is computed on, of the images' own

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
