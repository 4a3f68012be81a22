// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

/// How keyframes are fused into a dense map.
struct ROSLAM_EXPORT DenseOptions {
  bool enabled = true;
  bool remove = true;       ///< skip removed pixels; false (for comparison): fuse images as taken
  bool restore = true;      ///< restore keyframes first, so that dynamic objects leave no holes
  double voxel_size = 0.0;  ///< metres; 0: 0.02 if the first keyframe's median depth is below 4 m, else 0.05
  double max_depth = 10.0;  ///< metres; farther readings are too noisy to fuse and only carve free space
  int stride = 2;           ///< subsampling of the image along rows and columns, pixels
  double truncation = 4.0;  ///< voxels, truncation distance of the TSDF on both sides of a surface
  double min_weight = 0.1;  ///< mean weight of voxels to be part of the map; a reading at 1 m weighs 1
  double follow = 0.5;      ///< voxels by which a keyframe must have moved to be re-integrated
  int follow_every = 10;    ///< keyframes between checks for moved keyframes while running
  int max_memory = 256;     ///< MB of voxels; above it the voxel size is doubled
  int queue = 20;           ///< keyframes that may wait in real-time mode; the oldest are dropped
  bool keep_movable = false;  ///< keep surfaces whose label is of a movable class

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
