// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "roslam/dense/dense_options.hpp"
#include "roslam/dense/depth_keyframe.hpp"
#include "roslam/dense/voxel.hpp"
#include "roslam/estimation/measurement_model.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

using BlockSet = std::unordered_set<BlockKey, BlockKeyHash>;

/// A truncated signed distance field (Curless and Levoy 1996) in the world frame, in blocks allocated only
/// near surfaces (voxel hashing, Niessner et al. 2013). Distances are point-to-plane, along the surface
/// normal, so that a road seen at a grazing angle is as accurate as a wall seen head-on. Not thread-safe.
class TsdfVolume {
 public:
  /// voxel_size: metres.
  TsdfVolume(double voxel_size, const DenseOptions& options, const MeasurementNoise& noise);

  /// Integrates a keyframe. within: only these blocks; null: all.
  void integrate(const DepthKeyframe& keyframe, const SE3& T_world_camera, const BlockSet* within = nullptr);

  /// Blocks that integrating the keyframe at that pose changes.
  BlockSet affected_blocks(const DepthKeyframe& keyframe, const SE3& T_world_camera) const;

  /// Replaces these blocks by those of another volume of the same voxels; those that it lacks are erased.
  void replace(const BlockSet& blocks, TsdfVolume other);

  const Block* find(const BlockKey& key) const;  ///< null if not allocated

  /// The keys of all blocks, sorted.
  std::vector<BlockKey> keys() const;

  std::size_t blocks() const { return blocks_.size(); }
  /// Memory of the blocks, estimated.
  std::size_t bytes() const { return blocks_.size() * (sizeof(Block) + 64); }
  float voxel_size() const { return voxel_size_; }
  float truncation() const { return truncation_; }  ///< metres

  /// The centre of a voxel by its index in the block (world frame, metres).
  Eigen::Vector3f centre(const BlockKey& key, int x, int y, int z) const;

 private:
  struct RangeImage;

  BlockKey key_of(const Eigen::Vector3f& point) const;
  BlockSet surface_blocks(const RangeImage& image) const;
  void update(Block& block, const RangeImage& image) const;
  std::vector<Block*> blocks_in_reach(const RangeImage& image) const;

  float voxel_size_;
  float truncation_;
  MeasurementNoise noise_;
  std::unordered_map<BlockKey, std::unique_ptr<Block>, BlockKeyHash> blocks_;
};

}  // namespace roslam
