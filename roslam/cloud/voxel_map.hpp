// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "roslam/cloud/dense_options.hpp"
#include "roslam/cloud/dense_view.hpp"
#include "roslam/cloud/voxel.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

using BlockSet = std::unordered_set<BlockKey, BlockKeyHash>;

/// Space in voxels that keep the distance to the nearest surface (Curless and Levoy 1996), in blocks that
/// exist only near surfaces (Niessner et al. 2013). Distances are taken along the normal of the surface, so
/// that a road seen at a flat angle has them as right as a wall seen head-on.
class VoxelMap {
 public:
  /// voxel_size: metres.
  VoxelMap(double voxel_size, const DenseOptions& options, const MeasurementNoise& noise);

  /// Fuses a view. within: only these blocks; null: all.
  void integrate(const DenseView& view, const SE3& T_world_camera, const BlockSet* within = nullptr);

  /// Blocks that the view changes, or has changed, when it is fused at that pose.
  BlockSet reached(const DenseView& view, const SE3& T_world_camera) const;

  void erase(const BlockSet& blocks);

  const Block* find(const BlockKey& key) const;

  /// In an order that depends on the order of views alone.
  std::vector<BlockKey> keys() const;

  std::size_t blocks() const { return blocks_.size(); }
  std::size_t bytes() const { return blocks_.size() * (sizeof(Block) + 64); }
  float voxel_size() const { return voxel_size_; }
  float truncation() const { return truncation_; }  ///< metres

  /// The centre of a voxel, by its place in the block, in the world (metres).
  Eigen::Vector3f centre(const BlockKey& key, int x, int y, int z) const;

 private:
  struct Sight;

  BlockKey key_of(const Eigen::Vector3f& point) const;
  BlockSet surface_blocks(const Sight& sight) const;
  void update(Block& block, const Sight& sight) const;
  std::vector<Block*> reached_by(const Sight& sight) const;

  float voxel_size_;
  float truncation_;
  MeasurementNoise noise_;
  std::unordered_map<BlockKey, std::unique_ptr<Block>, BlockKeyHash> blocks_;
};

}  // namespace roslam
