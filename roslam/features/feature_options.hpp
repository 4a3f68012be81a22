// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

struct ROSLAM_EXPORT OrbOptions {
  int features = 1000;         ///< target number of points in an image
  int levels = 8;              ///< pyramid levels
  double scale_factor = 1.2;   ///< size ratio between levels
  int fast_threshold = 20;     ///< grey levels, contrast of a FAST corner
  int min_fast_threshold = 7;  ///< grey levels, used in cells without a corner at fast_threshold
  int cell_size = 64;          ///< pixels, side of the cells in which the threshold adapts
  int mask_margin = 4;         ///< pixels by which the mask is dilated

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Which depth readings are valid.
struct ROSLAM_EXPORT DepthOptions {
  double min_depth = 0.1;     ///< metres, nearer readings are unknown
  double max_depth = 20.0;    ///< metres, farther readings are unknown
  double edge_ratio = 0.05;   ///< depth is unknown where a neighbour differs by more than this fraction
  double edge_growth = 0.01;  ///< 1/metre, added to edge_ratio for each metre, as noise grows with distance
                              ///< and must not be mistaken for an edge

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
