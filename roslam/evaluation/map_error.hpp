// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "roslam/cloud/surface.hpp"
#include "roslam/evaluation/map_truth.hpp"
#include "roslam/evaluation/point_grid.hpp"

namespace roslam {

struct MapErrorOptions {
  double tolerance = 0.05;  ///< metres, in (0, gap]: points no farther apart are the same place
  double gap = 0.15;  ///< metres, > 0: nothing static is that near to a ghost, nothing of the map to a hole
  double ghost_reach = 0.1;  ///< metres, > 0: between a ghost and what moved there

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Of the points of a map that come from one origin, resting things left out. Values are NaN where there is
/// nothing to tell.
struct MapProvenanceError {
  Provenance provenance = Provenance::kMeasured;
  std::size_t points = 0;
  std::size_t ghost_points = 0;
  double accuracy = std::numeric_limits<double>::quiet_NaN();  ///< share within the tolerance of the truth
  double colour_error = std::numeric_limits<double>::quiet_NaN();  ///< grey levels, see MapError
};

/// How a map compares to what is static. Values are NaN where there is nothing to tell.
struct MapError {
  std::size_t points = 0;          ///< of the map
  std::size_t resting_points = 0;  ///< of them on movable things at rest: in no other figure
  std::size_t ghost_points = 0;    ///< of them left over from what moved
  std::size_t truth_points = 0;    ///< that the map should have

  double accuracy = 0.0;      ///< share of the map's points within the tolerance of the truth
  double completeness = 0.0;  ///< share of the truth within the tolerance of the map's points and triangles
  double f_score = 0.0;       ///< harmonic mean of both; 0 if one is 0 or the map is empty
  double ghosts = 0.0;        ///< share of the map's points
  double resting = 0.0;       ///< share of all the map's points
  double holes = 0.0;         ///< share of the truth with nothing of the map within the gap
  /// Share of the truth within the gap of the reference that is not within the gap of the map.
  double missing_of_reference = std::numeric_limits<double>::quiet_NaN();
  double median_distance = 0.0;  ///< metres from the map's points to the truth; kLookAround for farther ones
  double p90_distance = 0.0;     ///< the same, of nine in ten points
  double colour_error = 0.0;  ///< grey levels a channel to the nearest truth, of points within the tolerance
  std::array<MapProvenanceError, 3> by_provenance{};  ///< measured, reprojected, invented
};

/// Compares any number of maps with one truth.
class MapComparison {
 public:
  static constexpr double kLookAround = 0.3;  ///< metres: how far the nearest point is looked for

  /// Throws OptionsError.
  explicit MapComparison(const MapTruth& truth, const MapErrorOptions& options = {});

  /// The map that could be had at best, in the frame of the truth: what it lacks too is not missing.
  void set_reference(const Surface& reference);

  /// estimate: in the frame of the truth.
  MapError error(const Surface& estimate) const;

 private:
  void add_coverage(const Surface& estimate, MapError& error) const;

  MapErrorOptions options_;
  std::vector<StaticPoint> static_;
  std::vector<MovingPoint> moving_;
  std::vector<Eigen::Vector3f> near_;  // what a map should have
  PointGrid static_grid_;
  PointGrid moving_grid_;
  std::vector<bool> in_reference_;  // one a point of near_; empty: there is none
};

/// A surface whose world is put into another.
Surface moved(const Surface& surface, const SE3& T_target_source);

/// A map and what is said of it.
struct EvaluatedMap {
  std::string name;
  double trajectory_rmse =
      0.0;  ///< metres from the true positions after the alignment that put the map there
  MapError error;
};

/// A Markdown table with a column a map, and one of provenances; and one JSON object (null where there is no
/// value).
std::string to_markdown(const std::vector<EvaluatedMap>& maps);
std::string to_json(const std::vector<EvaluatedMap>& maps, const MapTruthOptions& truth,
                    const MapErrorOptions& options);

}  // namespace roslam
