// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/dense/depth_keyframe.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/occupancy/cell_set.hpp"

namespace roslam {

/// Largest distance of cells from the world origin along an axis, in cell sides.
inline constexpr int kFarthestCell = 32768;

/// Finds the cell that contains a point (world frame). scale: 1 / cell side (1/metre). Returns false beyond
/// kFarthestCell or if not finite.
bool find_cell(const Eigen::Vector3d& point, double scale, Eigen::Vector3i& cell);

/// The cells that a keyframe observes as free: those on the rays from the camera to measured depth, or to the
/// keyframe's reach where the surface lies beyond it, without cells that contain a reading. Reprojected and
/// inpainted pixels carve nothing. resolution: metres, cell side.
CellSet cells_seen_through(const DepthKeyframe& keyframe, const SE3& T_world_camera, double resolution);

}  // namespace roslam
