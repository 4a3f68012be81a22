// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "roslam/common/export.hpp"
#include "roslam/map/ids.hpp"

namespace roslam {

/// What is known of a cell of space.
enum class OccupancyState : std::uint8_t { kUnknown, kFree, kOccupied };

/// Free, occupied and unknown space at one time of the flight, in cells of the world frame of a submap.
/// Blocks of cells that did not change are shared with earlier grids. Immutable: may be read from any thread.
class ROSLAM_EXPORT OccupancyGrid {
 public:
  static constexpr int kBlockSide = 8;  ///< cells

  /// 8 x 8 x 8 cells, x fastest, then y. Cell (i, j, k) is the cube [i, i + 1) x ... times the resolution.
  struct Block {
    Eigen::Vector3i first_cell;
    std::span<const OccupancyState> cells;
  };
  using Visitor = std::function<void(const Block&)>;

  struct Content;
  explicit OccupancyGrid(std::shared_ptr<const Content> content) : content_(std::move(content)) {}

  OccupancyState at(const Eigen::Vector3d& point) const;  ///< world frame, metres

  double resolution() const;      ///< metres, the side of a cell
  SubmapId submap() const;        ///< whose world frame it is in
  std::size_t keyframes() const;  ///< that it is made of
  double timestamp() const;       ///< seconds, of the newest of them: how old the grid is

  void visit(const Visitor& visitor) const;

  /// Visits the blocks that differ from those of an earlier grid. A block that is gone is visited with
  /// unknown cells. All, if the other is of another submap or resolution.
  void visit_changed(const OccupancyGrid& earlier, const Visitor& visitor) const;

 private:
  std::shared_ptr<const Content> content_;
};

}  // namespace roslam
