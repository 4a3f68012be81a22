// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/map_error.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "roslam/common/error.hpp"

namespace roslam::evaluation {

namespace {
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr auto kReach = static_cast<float>(MapComparison::kLookAround);
constexpr std::array kProvenances{Provenance::kMeasured, Provenance::kReprojected, Provenance::kInpainted};

double share(std::size_t part, std::size_t all) {
  return all == 0 ? kNaN : static_cast<double>(part) / static_cast<double>(all);
}

template <typename Point>
std::vector<Eigen::Vector3f> positions(const std::vector<Point>& points) {
  std::vector<Eigen::Vector3f> result;
  result.reserve(points.size());
  for (const auto& point : points) result.push_back(point.position);
  return result;
}

// Samples triangles as well: the map covers the surface between its points.
std::vector<Eigen::Vector3f> with_triangles(const SurfaceMap& surface) {
  auto points = positions(surface.points);
  points.reserve(points.size() + 4 * surface.triangles.size());
  for (const auto& corners : surface.triangles) {
    const Eigen::Vector3f a = points[corners[0]], b = points[corners[1]], c = points[corners[2]];
    points.emplace_back((a + b + c) / 3.0F);
    points.emplace_back((a + b) / 2.0F);
    points.emplace_back((b + c) / 2.0F);
    points.emplace_back((a + c) / 2.0F);
  }
  return points;
}

// Quantile of distances in any order.
double quantile(std::vector<float>& distances, double part) {
  if (distances.empty()) return kNaN;
  const auto at = static_cast<std::ptrdiff_t>(part * static_cast<double>(distances.size()));
  std::nth_element(distances.begin(), distances.begin() + at, distances.end());
  return static_cast<double>(distances[static_cast<std::size_t>(at)]);
}

MapErrorOptions valid(const MapErrorOptions& options) {
  options.validate();
  return options;
}

std::size_t row_of(Provenance provenance) {
  const auto found = std::find(kProvenances.begin(), kProvenances.end(), provenance);
  return found == kProvenances.end() ? 0 : static_cast<std::size_t>(found - kProvenances.begin());
}

double f_score(double accuracy, double completeness) {
  return accuracy > 0.0 && completeness > 0.0 ? 2.0 * accuracy * completeness / (accuracy + completeness)
                                              : 0.0;
}

// Counts of the points of one provenance.
struct Tally {
  std::size_t points = 0;
  std::size_t within = 0;
  std::size_t ghosts = 0;
  std::size_t coloured = 0;
  double colour_sum = 0.0;

  void add_colour(const cv::Vec3b& colour, const cv::Vec3b& truth) {
    for (int channel = 0; channel < 3; ++channel) colour_sum += std::abs(colour[channel] - truth[channel]);
    coloured += 3;
  }
  void operator+=(const Tally& other) {
    points += other.points;
    within += other.within;
    ghosts += other.ghosts;
    coloured += other.coloured;
    colour_sum += other.colour_sum;
  }
  double accuracy() const { return share(within, points); }
  double colour_error() const { return coloured == 0 ? kNaN : colour_sum / static_cast<double>(coloured); }
};
}  // namespace

void MapErrorOptions::validate() const {
  const auto require = [](double value, double most, const char* what) {
    if (!(value > 0.0 && value <= most)) throw OptionsError(what);
  };
  require(gap, MapComparison::kLookAround, "gap must be above 0 and at most 0.3 m");
  require(tolerance, gap, "tolerance must be above 0 and at most the gap (0.15 m by default)");
  require(ghost_reach, MapComparison::kLookAround, "ghost_reach must be above 0 and at most 0.3 m");
}

MapComparison::MapComparison(const MapTruth& truth, const MapErrorOptions& options)
    : options_(valid(options)),
      static_(truth.static_points()),
      moving_(truth.moving_points()),
      static_grid_(positions(static_), kReach),
      moving_grid_(positions(moving_), static_cast<float>(options.ghost_reach)) {
  for (const auto& point : static_) {
    if (truth.is_near(point)) near_.push_back(point.position);
  }
}

void MapComparison::set_reference(const SurfaceMap& reference) {
  const PointGrid grid(with_triangles(reference), static_cast<float>(options_.gap));
  in_reference_.clear();
  for (const auto& point : near_) in_reference_.push_back(grid.nearest(point).has_value());
}

MapError MapComparison::error(const SurfaceMap& estimate) const {
  MapError error;
  error.points = estimate.points.size();
  std::array<Tally, kProvenances.size()> tallies;
  std::vector<float> distances;
  for (const auto& point : estimate.points) {
    const auto truth = static_grid_.nearest(point.position);
    const float distance = truth ? truth->distance : kReach;
    Tally& tally = tallies[row_of(point.provenance)];
    if (distance > static_cast<float>(options_.gap)) {
      const auto moving = moving_grid_.nearest(point.position);
      if (moving && moving_[moving->index].rests) {
        ++error.resting_points;
        continue;
      }
      if (moving) ++tally.ghosts;
    }
    ++tally.points;
    distances.push_back(distance);
    if (!truth || distance > static_cast<float>(options_.tolerance)) continue;
    ++tally.within;
    if (const auto& colour = static_[truth->index].colour) tally.add_colour(point.colour, *colour);
  }
  Tally all;
  for (std::size_t i = 0; i < tallies.size(); ++i) {
    const Tally& tally = tallies[i];
    all += tally;
    error.by_provenance[i] = {kProvenances[i], tally.points, tally.ghosts, tally.accuracy(),
                              tally.colour_error()};
  }
  error.ghost_points = all.ghosts;
  error.accuracy = all.accuracy();
  error.colour_error = all.colour_error();
  error.ghosts = share(all.ghosts, all.points);
  error.resting = share(error.resting_points, error.points);
  error.median_distance = quantile(distances, 0.5);
  error.p90_distance = quantile(distances, 0.9);
  add_coverage(estimate, error);
  error.f_score = f_score(error.accuracy, error.completeness);
  return error;
}

void MapComparison::add_coverage(const SurfaceMap& estimate, MapError& error) const {
  const PointGrid grid(with_triangles(estimate), static_cast<float>(options_.gap));
  std::size_t within = 0, holes = 0, in_reference = 0, missing = 0;
  for (std::size_t i = 0; i < near_.size(); ++i) {
    const auto found = grid.nearest(near_[i]);
    if (!found) ++holes;
    if (found && found->distance <= static_cast<float>(options_.tolerance)) ++within;
    if (in_reference_.empty() || !in_reference_[i]) continue;
    ++in_reference;
    if (!found) ++missing;
  }
  error.truth_points = near_.size();
  error.completeness = share(within, near_.size());
  error.holes = share(holes, near_.size());
  if (!in_reference_.empty()) error.missing_of_reference = share(missing, in_reference);
}

SurfaceMap moved(const SurfaceMap& surface, const SE3& T_target_source) {
  const Eigen::Matrix3f rotation = T_target_source.rotation().toRotationMatrix().cast<float>();
  SurfaceMap result = surface;
  for (auto& point : result.points) {
    point.position = (T_target_source * point.position.cast<double>()).cast<float>();
    point.normal = rotation * point.normal;
  }
  return result;
}

}  // namespace roslam::evaluation
