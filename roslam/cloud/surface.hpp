// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/cloud/dense_options.hpp"
#include "roslam/cloud/voxel_map.hpp"
#include "roslam/restoration/provenance.hpp"

namespace roslam {

struct SurfacePoint {
  Eigen::Vector3f position;    ///< world, metres
  Eigen::Vector3f normal;      ///< unit, towards free space
  cv::Vec3b colour;            ///< BGR
  std::uint8_t label = kVoid;  ///< class that most views gave it; kVoid: unknown
  Provenance provenance = Provenance::kMeasured;
};

/// Points of surfaces and the triangles between them (corners anticlockwise as seen from free space).
struct Surface {
  double spacing = 0.0;  ///< metres between points, the side of a voxel; 0 = unknown
  std::vector<SurfacePoint> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// The surfaces in a voxel map by naive surface nets (Gibson 1998): a point in each cube of eight voxels that
/// a surface passes through, a square of two triangles about each edge between voxels that it cuts.
Surface extract_surface(const VoxelMap& map, const DenseOptions& options);

/// Without the points that keep says no to, and the triangles they are corners of. keep: one a point.
Surface kept(const Surface& surface, const std::vector<bool>& keep);

/// What was seen, in one view or another.
Surface without_invented(const Surface& surface);

/// Points of each provenance.
std::map<Provenance, std::size_t> count_by_provenance(const Surface& surface);

}  // namespace roslam
