// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/dense/dense_options.hpp"
#include "roslam/restoration/provenance.hpp"
#include "roslam/semantics/label_set.hpp"

namespace roslam {

class TsdfVolume;

struct ROSLAM_EXPORT SurfacePoint {
  Eigen::Vector3f position;    ///< world frame, metres
  Eigen::Vector3f normal;      ///< unit, towards free space
  cv::Vec3b colour;            ///< BGR
  std::uint8_t label = kVoid;  ///< majority label of the keyframes; kVoid: unknown
  Provenance provenance = Provenance::kMeasured;
};

/// A triangle mesh of surfaces (corners anticlockwise as seen from free space).
struct ROSLAM_EXPORT SurfaceMap {
  double spacing = 0.0;  ///< metres, the voxel size; 0 = unknown
  std::vector<SurfacePoint> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Extracts the zero level set of a TSDF by surface nets (Gibson 1998): a point for each patch of surface in
/// a cube of eight voxels (Nielson 2004), two triangles around each voxel edge that it cuts. At most two
/// triangles share an edge, in opposite directions; normals of points and triangles agree.
ROSLAM_EXPORT SurfaceMap extract_surface(const TsdfVolume& map, const DenseOptions& options);

/// The points with keep set, and the triangles whose corners are all kept. keep: one entry for each point.
ROSLAM_EXPORT SurfaceMap filter_points(const SurfaceMap& surface, const std::vector<bool>& keep);

/// The measured and reprojected points.
ROSLAM_EXPORT SurfaceMap without_inpainted(const SurfaceMap& surface);

/// Number of points of each provenance.
ROSLAM_EXPORT std::map<Provenance, std::size_t> count_by_provenance(const SurfaceMap& surface);

}  // namespace roslam
