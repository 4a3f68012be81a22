// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/cloud/cell_set.hpp"
#include "roslam/cloud/dense_view.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// Cells lie at most so far from the origin of the world, in units of their side.
inline constexpr int kFarthestCell = 32768;

/// The cell that a point is in. scale: one over the side of a cell (1/metre). Not within kFarthestCell:
/// false.
bool find_cell(const Eigen::Vector3d& point, double scale, Eigen::Vector3i& cell);

/// The cells that a view sees through: those that lie between the camera and readings that were measured, or
/// the view's reach where they are farther, less those that a reading lies in. Nobody looked along the rays
/// to pixels that were filled in. resolution: metres, the side of a cell.
CellSet cells_seen_through(const DenseView& view, const SE3& T_world_camera, double resolution);

}  // namespace roslam
