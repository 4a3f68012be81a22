// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/removal/cell_grid.hpp"
#include "roslam/removal/flow_check.hpp"
#include "roslam/removal/free_space.hpp"
#include "roslam/removal/movable_object.hpp"
#include "roslam/removal/removal_options.hpp"

namespace roslam {

/// What is known of a frame, cell by cell, and which object each cell shows. All images are of cells.
struct CellScene {
  cv::Mat depth;  ///< CV_32FC1 metres, 0 = unknown
  FreeSpaceEvidence space;
  FollowedPoints flow;
  cv::Mat moving;  ///< CV_8UC1: seen to move, by free space or flow
  cv::Mat seeds;   ///< CV_8UC1: shown to belong to a thing by this frame, and not only by those before
  cv::Mat owners;  ///< CV_32SC1: position of the object in its list plus one; 0 = none

  /// CV_8UC1: 255 where free space says that.
  cv::Mat cells_that_are(Evidence evidence) const { return space.state == static_cast<int>(evidence); }
};

/// Gives each cell to the object it shows. before: the objects as they were carried here, without new labels:
/// what belonged to a thing a moment ago and moves still belongs to it.
void claim_cells(CellScene& scene, const std::vector<MovableObject>& objects,
                 const std::vector<MovableObject>& before, const CellGrid& grid,
                 const RemovalOptions& options);

/// CV_16UC1 of the picture's size: the owner of each pixel, numbered as in the scene, fitted to depth
/// (CV_32FC1 of the picture, metres).
cv::Mat owners_of_pixels(const CellScene& scene, const std::vector<MovableObject>& objects,
                         const cv::Mat& depth, const CellGrid& grid, const RemovalOptions& options);

}  // namespace roslam
