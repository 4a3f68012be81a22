// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/geometry/reprojection.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/removal/cell_grid.hpp"
#include "roslam/removal/removal_options.hpp"

namespace roslam {

/// What the depth of earlier frames says about a cell of the current one.
enum class Evidence : std::uint8_t {
  kUnknown,  ///< no earlier frame saw that place
  kStatic,   ///< the same surface was there before
  kMoving    ///< earlier frames saw through the place where a surface is now
};

/// Evidence for every cell.
struct FreeSpaceEvidence {
  cv::Mat state;       ///< CV_8UC1 of cells: Evidence
  cv::Mat static_for;  ///< CV_32FC1 of cells: age in seconds of the oldest frame that saw the same surface,
                       ///< else 0
};

/// The depth of the last seconds, and the test of a frame against it: a surface in what was free space has
/// moved there. Static surfaces cannot fail it, whatever the camera's motion hides and uncovers, beyond the
/// noise of depth and pose; this is the multi-view check of DynaSLAM, turned to the side that has no false
/// alarms from occlusion.
class FreeSpaceHistory {
 public:
  FreeSpaceHistory(const RemovalOptions& options, const MeasurementNoise& noise)
      : options_(options), noise_(noise) {}

  /// depth: of cells (CellGrid::depth_cells).
  FreeSpaceEvidence examine(const CellGrid& grid, const cv::Mat& depth, const SE3& T_camera_world,
                            double timestamp) const;

  /// Keeps a frame if it is time for another. depth: of cells.
  void add(const cv::Mat& depth, const SE3& T_camera_world, double timestamp);

  /// Takes over a correction of the world: the same points, elsewhere.
  void move_world(const SE3& T_new_old);

  /// Forgets all: the world is another now.
  void clear() { views_.clear(); }

  bool empty() const { return views_.empty(); }

 private:
  struct View {
    double timestamp;
    SE3 T_camera_world;
    cv::Mat nearest;   // CV_32FC1: least depth around each cell, 0 = unknown at the cell
    cv::Mat farthest;  // CV_32FC1: largest depth around each cell
  };

  RemovalOptions options_;
  MeasurementNoise noise_;
  std::deque<View> views_;
};

}  // namespace roslam
