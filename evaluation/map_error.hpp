// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "evaluation/map_truth.hpp"
#include "evaluation/point_grid.hpp"
#include "roslam/dense/surface_map.hpp"

namespace roslam::evaluation {

struct MapErrorOptions {
  double tolerance = 0.05;  ///< metres, in (0, gap]: a point this near to the other cloud is correct
  double gap = 0.15;  ///< metres, > 0: from ghost points to the static scene, from holes to the map, at least
  double ghost_reach = 0.1;  ///< metres, > 0: from a ghost point to a point of a moving object, at most

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Errors of the map points of one provenance, without those on movable objects at rest. Values without data
/// are NaN.
struct MapProvenanceError {
  Provenance provenance = Provenance::kMeasured;
  std::size_t points = 0;
  std::size_t ghost_points = 0;
  double accuracy = std::numeric_limits<double>::quiet_NaN();  ///< share within the tolerance of the truth
  double colour_error = std::numeric_limits<double>::quiet_NaN();  ///< grey levels, see MapError
};

/// Errors of a map against the static scene. Ghosts are map points where only a moving object was: beyond the
/// gap from the static scene and within ghost_reach of a moving object. Values without data are NaN.
struct MapError {
  std::size_t points = 0;          ///< of the map
  std::size_t resting_points = 0;  ///< of them on movable objects at rest: in no other value
  std::size_t ghost_points = 0;    ///< of them where only a moving object was
  std::size_t truth_points = 0;    ///< static points that the map should contain

  double accuracy = 0.0;      ///< share of the map's points within the tolerance of the truth
  double completeness = 0.0;  ///< share of the truth within the tolerance of the map's points and triangles
  double f_score = 0.0;       ///< harmonic mean of both; 0 if one is 0 or the map is empty
  double ghosts = 0.0;        ///< share of ghost points in the map's points
  double resting = 0.0;       ///< share of resting_points in all points of the map
  double holes = 0.0;         ///< share of the truth farther than the gap from the map
  /// Of the truth within the gap of the reference, the share that is not within the gap of the map.
  double missing_of_reference = std::numeric_limits<double>::quiet_NaN();
  double median_distance = 0.0;  ///< metres from the map's points to the truth, at most kLookAround
  double p90_distance = 0.0;     ///< the same, 90th percentile
  double colour_error = 0.0;     ///< mean absolute, grey levels a channel, of points within the tolerance
  std::array<MapProvenanceError, 3> by_provenance{};  ///< measured, reprojected, inpainted
};

/// Compares any number of maps with one truth.
class MapComparison {
 public:
  static constexpr double kLookAround = 0.3;  ///< metres: search radius for the nearest point

  /// Throws OptionsError.
  explicit MapComparison(const MapTruth& truth, const MapErrorOptions& options = {});

  /// The best map attainable, in the frame of the truth: what it lacks too does not count as missing.
  void set_reference(const SurfaceMap& reference);

  /// estimate: in the frame of the truth.
  MapError error(const SurfaceMap& estimate) const;

 private:
  void add_coverage(const SurfaceMap& estimate, MapError& error) const;

  MapErrorOptions options_;
  std::vector<StaticPoint> static_;
  std::vector<MovingPoint> moving_;
  std::vector<Eigen::Vector3f> near_;  // static points that a map should contain
  PointGrid static_grid_;
  PointGrid moving_grid_;
  std::vector<bool> in_reference_;  // one a point of near_; empty: there is none
};

/// The surface transformed into another frame.
SurfaceMap moved(const SurfaceMap& surface, const SE3& T_target_source);

/// A map and its errors.
struct EvaluatedMap {
  std::string name;
  double trajectory_rmse = 0.0;  ///< metres, RMSE after the alignment that also placed the map
  MapError error;
};

/// A Markdown table with a column a map, and one of provenances; and one JSON object (null where there is no
/// value).
std::string to_markdown(const std::vector<EvaluatedMap>& maps);
std::string to_json(const std::vector<EvaluatedMap>& maps, const MapTruthOptions& truth,
                    const MapErrorOptions& options);

}  // namespace roslam::evaluation
