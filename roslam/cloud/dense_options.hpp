// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace roslam {

/// How keyframes become a dense map.
struct DenseOptions {
  bool enabled = true;
  bool remove = true;         ///< leave out what was removed; false, to compare: fuse pictures as taken
  bool restore = true;        ///< restore keyframes first, so that what moves leaves no holes
  double voxel_size = 0.0;    ///< metres; 0: 0.02 where the first view is of things within 4 m, else 0.05
  double max_depth = 10.0;    ///< metres, farther readings are too noisy
  int stride = 2;             ///< pixels of the picture, both ways, to one that is fused
  double truncation = 4.0;    ///< voxels, how far before and behind a surface its distance is kept
  double min_weight = 0.1;    ///< of a surface to be part of the map; a reading at close range counts 1
  double follow = 0.5;        ///< voxels that a view must have moved by to be fused anew
  int follow_every = 10;      ///< keyframes, how often it is looked in flight what has moved
  int max_memory = 256;       ///< MB that voxels may take; a map that needs more becomes coarser
  int queue = 20;             ///< keyframes that may wait in real-time mode; older ones are dropped
  bool keep_movable = false;  ///< keep surfaces that most labels take for something that may move

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
