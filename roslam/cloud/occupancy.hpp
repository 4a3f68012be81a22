// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>

#include "roslam/cloud/dense_view.hpp"
#include "roslam/cloud/surface.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/ids.hpp"

namespace octomap {
class OcTree;
}

namespace roslam {

class CellBlock;
class DenseMapper;
struct BlockKey;

enum class Space { kUnknown, kFree, kOccupied };

/// Space in cells: where there is something, where a camera saw that there is nothing, and where nobody
/// looked. What path planners ask of a map. Kept as an octree that is written as OctoMap files (Hornung et
/// al. 2013). Its cells lie within 32768 of them from the origin of the world.
class Occupancy {
 public:
  /// resolution: metres, the side of a cell, 0.001 to 10. Throws OptionsError.
  explicit Occupancy(double resolution);
  ~Occupancy();
  Occupancy(Occupancy&&) noexcept;
  Occupancy& operator=(Occupancy&&) noexcept;

  /// Cells between the camera and what it measured are free, where they are not occupied.
  void add_view(const DenseView& view, const SE3& T_world_camera);

  /// Cells that hold a point are occupied, free or not. Throws OptionsError if a point is too far from the
  /// origin for cells of this size.
  void add_surface(const Surface& surface);

  /// Cells whose centre is free in another are free, where they are not occupied.
  void free_from(const Occupancy& other);

  Space at(const Eigen::Vector3d& point) const;  ///< world, metres
  double resolution() const;                     ///< metres
  double free_volume() const;                    ///< cubic metres
  double occupied_volume() const;                ///< cubic metres

  /// Writes an OctoMap file: .bt with the three states, .ot with their probabilities, which say the same. A
  /// file that was there stays until the new one is whole. Throws OptionsError for another ending,
  /// OutputError.
  void write(const std::filesystem::path& file) const;

  /// Reads an OctoMap file, ours or another's: .bt, or .ot of an OcTree, whose cells become free or occupied,
  /// whichever is likelier. Throws InputError naming the file and what is wrong with it.
  static Occupancy read(const std::filesystem::path& file);

 private:
  void put(const BlockKey& key, const CellBlock& marks, bool is_occupied);
  double volume(bool is_occupied) const;

  std::unique_ptr<octomap::OcTree> tree_;
};

/// Of a world of a dense map: occupied where its surface is, free where its views looked through. resolution:
/// metres; 0: two voxels, but not below 0.05. Throws OptionsError.
Occupancy occupancy_of(const DenseMapper& mapper, WorldId world, const Surface& surface, double resolution);

/// The resolution of cells for points at that spacing (metres, 0 = unknown): two of it, but not below 0.05.
double usual_resolution(double spacing);

}  // namespace roslam
