// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/dynamic_objects/cell_grid.hpp"
#include "roslam/dynamic_objects/depth_consistency.hpp"
#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/dynamic_objects/flow_consistency.hpp"
#include "roslam/dynamic_objects/movable_object.hpp"

namespace roslam {

/// The evidence of a frame, cell by cell, and the object that each cell belongs to. All images are of cells.
struct CellScene {
  cv::Mat depth;  ///< CV_32FC1 metres, 0 = unknown
  DepthEvidence depth_evidence;
  TrackedPoints flow;
  cv::Mat moving;  ///< CV_8UC1: moving by depth consistency or flow
  cv::Mat seeds;   ///< CV_8UC1: of an object by evidence of this frame, not only of earlier ones
  cv::Mat owners;  ///< CV_32SC1: index of the object in its list plus one; 0 = none

  /// CV_8UC1: 255 where depth consistency has that result.
  cv::Mat cells_that_are(MotionEvidence evidence) const {
    return depth_evidence.state == static_cast<int>(evidence);
  }
};

/// Assigns cells to objects. propagated: the objects of earlier frames propagated to this one, without new
/// labels; moving cells of these stay assigned.
void assign_cells(CellScene& scene, const std::vector<MovableObject>& objects,
                  const std::vector<MovableObject>& propagated, const CellGrid& grid,
                  const DynamicObjectOptions& options);

/// The owners of the pixels of a part of the image, numbered as in the scene.
struct PixelOwners {
  cv::Rect area;   ///< pixels; without owner outside. Empty = no pixel has an owner
  cv::Mat owners;  ///< CV_16UC1 of the area's size
};

/// The owner of each pixel, with borders refined by depth (CV_32FC1 of the image, metres).
PixelOwners owners_of_pixels(const CellScene& scene, const std::vector<MovableObject>& objects,
                             const cv::Mat& depth, const CellGrid& grid, const DynamicObjectOptions& options);

}  // namespace roslam
