// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <unordered_map>

#include "roslam/occupancy/cell_set.hpp"
#include "roslam/occupancy/occupancy_grid.hpp"

namespace roslam {

/// What an OccupancyGrid shares with others.
struct OccupancyGrid::Content {
  using Cells = std::array<OccupancyState, kBlockVoxels>;  // as OccupancyGrid::Block
  std::unordered_map<BlockKey, std::shared_ptr<const Cells>, BlockKeyHash> blocks;
  double resolution = 0.0;
  SubmapId submap;
  std::size_t keyframes = 0;
  double timestamp = 0.0;
};

/// Position of a cell in its block.
inline std::size_t index_of(const Eigen::Vector3i& cell) {
  const Eigen::Array3i within = cell.array().unaryExpr([](int c) { return c & (kBlockSide - 1); });
  return Block::index(within.x(), within.y(), within.z());
}

}  // namespace roslam
