// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <unordered_map>
#include <vector>

#include "roslam/dense/dense_mapper.hpp"
#include "roslam/occupancy/cell_set.hpp"
#include "roslam/occupancy/occupancy_content.hpp"

namespace roslam {

/// Keeps occupancy up with a dense map that grows: a cell is occupied while a voxel in it is at a surface
/// that was seen often enough, else free while a keyframe sees through it. Both are counted, so that what a
/// moved keyframe or changed voxels had contributed is taken back exactly. Not thread safe.
class LiveOccupancy {
 public:
  explicit LiveOccupancy(const DenseOptions& options) : options_(options) {}

  /// Takes over what changed in the dense map since the last call (DenseMapper::take_changes).
  void update(const DenseMapper& mapper, const DenseChanges& changes);

  /// The occupancy of a submap; null if it has none. timestamp: seconds, of its newest keyframe.
  std::shared_ptr<const OccupancyGrid> grid(SubmapId submap, double timestamp);

 private:
  struct Counts {
    std::array<std::uint16_t, kBlockVoxels> seen_through{};  // by keyframes
    std::array<std::uint16_t, kBlockVoxels> surfaces{};      // voxels
  };
  struct Space {
    std::unordered_map<BlockKey, Counts, BlockKeyHash> counts;
    std::unordered_map<BlockKey, std::vector<Eigen::Vector3i>, BlockKeyHash> surface_cells;  // by voxel block
    BlockSet touched;  // since the last grid
    std::shared_ptr<const OccupancyGrid::Content> last;
    std::size_t keyframes = 0;
  };

  void see_through(Space& space, const DepthKeyframe& keyframe, const SE3& T_world_camera, int sign);
  void find_surfaces(Space& space, const TsdfVolume* voxels, const BlockKey& key);

  DenseOptions options_;
  double resolution_ = 0.0;
  std::map<SubmapId, Space> spaces_;
};

}  // namespace roslam
