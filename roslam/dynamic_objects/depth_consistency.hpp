// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/dynamic_objects/cell_grid.hpp"
#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/geometry/depth_noise.hpp"
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

/// A frame in cells of a CellGrid.
struct CellImages {
  cv::Mat depth;  ///< CV_32FC1, metres, 0 = unknown (CellGrid::depth_cells)
  cv::Mat grey;   ///< CV_8UC1, mean brightness (CellGrid::grey_cells); empty: appearance is not compared
};

/// Checks a frame against the depth of the last seconds: a surface in what was free space has moved there.
/// Occlusion and disocclusion of static surfaces cannot cause false positives, only noise of depth and pose
/// can. What enters free space hides what was seen behind it, so where the image still shows that background,
/// the depth is wrong, as stereo cameras' is in patches on surfaces without texture. Related to the
/// multi-view check of DynaSLAM (Bescos et al., RA-L 2018), in the opposite direction.
class DepthConsistency {
 public:
  DepthConsistency(const DynamicObjectOptions& options, const DepthNoise& noise)
      : options_(options), noise_(noise) {}

  void set_depth_noise(const DepthNoise& noise) { noise_ = noise; }

  DepthEvidence examine(const CellGrid& grid, const CellImages& cells, const SE3& T_camera_world,
                        double timestamp) const;

  /// Stores a frame if history_interval has passed since the last one.
  void add(const CellImages& cells, const SE3& T_camera_world, double timestamp);

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
    cv::Mat grey;      // CV_8UC1, or empty
  };

  struct PackedCells;
  struct Votes;
  struct Projection;

  Votes votes_on(const CellGrid& grid, const CellImages& images, const SE3& T_camera_world,
                 double timestamp) const;
  void vote(const CellGrid& grid, const PackedCells& cells, const cv::Mat& grey, const SE3& T_camera_world,
            double timestamp, Votes& votes) const;
  bool shows_background(const CellGrid& grid, int cell, const cv::Mat& grey, const Projection& to_past,
                        const PastDepth& past, float background_depth, float gain) const;
  float variance(float depth) const;

  DynamicObjectOptions options_;
  DepthNoise noise_;
  std::deque<PastDepth> past_;
};

}  // namespace roslam
