// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>

#include "roslam/common/export.hpp"
#include "roslam/dense/surface_map.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/occupancy/occupancy_grid.hpp"

namespace octomap {
class OcTree;
}

namespace roslam {

class CellBlock;
struct DepthKeyframe;
class DenseMapper;
struct BlockKey;

/// Occupied, free and unknown space for path planning: an octree in the world frame, written as OctoMap files
/// (Hornung et al. 2013). Cells lie within 32768 cell sides of the world origin. Not thread-safe.
class ROSLAM_EXPORT OccupancyMap {
 public:
  /// resolution: metres, the side of a cell, 0.001 to 10. Throws OptionsError.
  explicit OccupancyMap(double resolution);
  ~OccupancyMap();
  OccupancyMap(OccupancyMap&&) noexcept;
  OccupancyMap& operator=(OccupancyMap&&) noexcept;

  /// Ray carving: cells between the camera and measured surfaces become free unless they are occupied.
  void add_view(const DepthKeyframe& keyframe, const SE3& T_world_camera);

  /// Cells that contain a surface point become occupied, also free ones. Throws OptionsError if a point is
  /// too far from the origin for the resolution.
  void add_surface(const SurfaceMap& surface);

  /// Cells whose centre is free in the other map become free unless they are occupied.
  void free_from(const OccupancyMap& other);

  OccupancyState at(const Eigen::Vector3d& point) const;  ///< world frame, metres
  double resolution() const;                              ///< metres
  double free_volume() const;                             ///< cubic metres
  double occupied_volume() const;                         ///< cubic metres

  /// Writes an OctoMap file: .bt (states) or .ot (the same as log odds). Atomic: an existing file is replaced
  /// only by a complete one. Throws OptionsError for another extension, OutputError.
  void write(const std::filesystem::path& file) const;

  /// Reads any OctoMap file of an OcTree: .bt or .ot, whose cells become free or occupied by maximum
  /// likelihood. Throws InputError naming the file and the fault.
  static OccupancyMap read(const std::filesystem::path& file);

 private:
  void set_cells(const BlockKey& key, const CellBlock& marks, bool is_occupied);
  double volume(bool is_occupied) const;

  std::unique_ptr<octomap::OcTree> tree_;
};

/// The occupancy of a submap of a dense map: occupied at its surface, free along the rays of its keyframes.
/// resolution: metres; 0: usual_resolution() of the voxel size. Throws OptionsError.
ROSLAM_EXPORT OccupancyMap occupancy_map_of(const DenseMapper& mapper, SubmapId submap,
                                            const SurfaceMap& surface, double resolution);

/// Default cell side for a point spacing (metres, 0 = unknown): twice the spacing, within 0.05 to 10 metres.
ROSLAM_EXPORT double usual_resolution(double spacing);

}  // namespace roslam
