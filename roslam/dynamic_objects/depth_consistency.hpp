// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/dynamic_objects/cell_grid.hpp"
#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/estimation/measurement_model.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// The result of the depth consistency check for a cell of the current frame.
enum class MotionEvidence : std::uint8_t {
  kUnknown,  ///< no earlier frame saw that point
  kStatic,   ///< the same surface was there before
  kMoving    ///< earlier frames saw free space where a surface is now
};

/// Evidence for every cell.
struct DepthEvidence {
  cv::Mat state;       ///< CV_8UC1 of cells: MotionEvidence
  cv::Mat static_for;  ///< CV_32FC1 of cells: age (seconds) of the oldest frame with the same surface, or 0
};

/// Checks a frame against the depth of the last seconds: a surface in what was free space has moved there.
/// Occlusion and disocclusion of static surfaces cannot cause false positives, only noise of depth and pose
/// can. Related to the multi-view check of DynaSLAM (Bescos et al., RA-L 2018), in the opposite direction.
class DepthConsistency {
 public:
  DepthConsistency(const DynamicObjectOptions& options, const MeasurementNoise& noise)
      : options_(options), noise_(noise) {}

  /// depth: of cells (CellGrid::depth_cells).
  DepthEvidence examine(const CellGrid& grid, const cv::Mat& depth, const SE3& T_camera_world,
                        double timestamp) const;

  /// Stores a frame if history_interval has passed since the last one. depth: of cells.
  void add(const cv::Mat& depth, const SE3& T_camera_world, double timestamp);

  /// Applies a correction of the map; T_new_old maps old to new world coordinates.
  void apply_correction(const SE3& T_new_old);

  /// Drops all stored frames, as after a change of submap.
  void clear() { past_.clear(); }

  bool empty() const { return past_.empty(); }

 private:
  struct PastDepth {
    double timestamp;
    SE3 T_camera_world;
    cv::Mat nearest;   // CV_32FC1: least depth around each cell, 0 = unknown at the cell
    cv::Mat farthest;  // CV_32FC1: largest depth around each cell
  };

  struct PackedCells;
  struct Votes;

  Votes votes_on(const CellGrid& grid, const cv::Mat& depth, const SE3& T_camera_world,
                 double timestamp) const;
  void vote(const CellGrid& grid, const PackedCells& cells, const SE3& T_camera_world, double timestamp,
            Votes& votes) const;
  float variance(float depth) const;

  DynamicObjectOptions options_;
  MeasurementNoise noise_;
  std::deque<PastDepth> past_;
};

}  // namespace roslam
