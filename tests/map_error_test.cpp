// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/map_error.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "roslam/common/error.hpp"

namespace roslam {

using namespace evaluation;
namespace {

// A camera before a wall 2 m away. With one pixel in two the truth is a grid of 80 x 60 points, 4 cm apart.
constexpr int kColumns = 80;
constexpr int kPoints = 80 * 60;
const cv::Rect kMover(10, 10, 20, 40);    // pixels
const cv::Rect kParked(110, 60, 30, 40);  // pixels
const cv::Vec3b kPaint(10, 120, 230);

Camera camera() {
  Camera camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 100.0;
  camera.cx = 80.0;
  camera.cy = 60.0;
  return camera;
}

cv::Mat image(int type, const cv::Scalar& value) { return {120, 160, type, value}; }

MapTruthFrame wall(double depth = 2.0) {
  MapTruthFrame frame;
  frame.background_depth = image(CV_32FC1, cv::Scalar(depth));
  frame.background_colour = image(CV_8UC3, cv::Scalar(kPaint[0], kPaint[1], kPaint[2]));
  return frame;
}

// A walking and a parked object, both 1 m in front of the camera.
MapTruthFrame wall_with_things() {
  MapTruthFrame frame = wall();
  frame.taken_depth = frame.background_depth.clone();
  frame.taken_depth(kMover).setTo(1.0);
  frame.taken_depth(kParked).setTo(1.0);
  frame.moving = MovingTruth{image(CV_8UC1, 0), image(CV_8UC1, 0)};
  frame.moving->actors(kMover).setTo(255);
  frame.moving->at_rest(kParked).setTo(255);
  return frame;
}

MapTruth truth_of(const MapTruthFrame& frame, const MapTruthOptions& options = {}) {
  MapTruth truth(camera(), options);
  truth.add(frame);
  return truth;
}

// The point of the wall in a column and row of the grid.
SurfacePoint at(int column, int row, double depth = 2.0) {
  SurfacePoint point;
  point.position = camera().unproject(Eigen::Vector2d(2.0 * column, 2.0 * row), 1.0).cast<float>() *
                   static_cast<float>(depth);
  point.normal = -Eigen::Vector3f::UnitZ();
  point.colour = kPaint;
  return point;
}

SurfaceMap map_of_columns(int from, int to, int step = 1) {
  SurfaceMap map;
  for (int row = 0; row < 60; row += step)
    for (int column = from; column < to; column += step) map.points.push_back(at(column, row));
  return map;
}

SurfaceMap whole_map() { return map_of_columns(0, kColumns); }

// Points of the map on an object at 1 m depth.
std::size_t put_on(const cv::Rect& thing, SurfaceMap& map) {
  std::size_t count = 0;
  for (int y = thing.y; y < thing.y + thing.height; y += 2) {
    for (int x = thing.x; x < thing.x + thing.width; x += 2, ++count)
      map.points.push_back(at(x / 2, y / 2, 1.0));
  }
  return count;
}

TEST(MapComparison, AMapThatIsTheTruthHasNoError) {
  const MapError error = MapComparison(truth_of(wall_with_things())).error(whole_map());
  EXPECT_EQ(error.points, static_cast<std::size_t>(kPoints));
  EXPECT_EQ(error.truth_points, static_cast<std::size_t>(kPoints));
  EXPECT_EQ(error.accuracy, 1.0);
  EXPECT_EQ(error.completeness, 1.0);
  EXPECT_EQ(error.f_score, 1.0);
  EXPECT_EQ(error.ghosts, 0.0);
  EXPECT_EQ(error.resting, 0.0);
  EXPECT_EQ(error.holes, 0.0);
  EXPECT_EQ(error.colour_error, 0.0);
  EXPECT_LT(error.p90_distance, 1e-6);
  EXPECT_TRUE(std::isnan(error.missing_of_reference));
}

// The wall from 0 on is missing; what is left ends at -0.04 m.
TEST(MapComparison, WhatIsCutOutIsIncompleteAndAHole) {
  const MapError error = MapComparison(truth_of(wall())).error(map_of_columns(0, 40));
  EXPECT_EQ(error.accuracy, 1.0);
  EXPECT_DOUBLE_EQ(error.completeness, 41.0 / 80.0);  // with the column at 0
  EXPECT_DOUBLE_EQ(error.holes, 37.0 / 80.0);         // without those at 0, 0.04 and 0.08 m
  EXPECT_DOUBLE_EQ(error.f_score, 2.0 * (41.0 / 80.0) / (1.0 + 41.0 / 80.0));
}

TEST(MapComparison, OnlyWhatTheReferenceHasIsMissing) {
  MapComparison comparison(truth_of(wall()));
  comparison.set_reference(whole_map());
  EXPECT_DOUBLE_EQ(comparison.error(map_of_columns(0, 40)).missing_of_reference, 37.0 / 80.0);
  EXPECT_EQ(comparison.error(whole_map()).missing_of_reference, 0.0);
  comparison.set_reference(map_of_columns(0, 57));  // covers three more columns
  EXPECT_DOUBLE_EQ(comparison.error(map_of_columns(0, 40)).missing_of_reference, (60.0 - 43.0) / 60.0);
  comparison.set_reference(map_of_columns(0, 40));
  EXPECT_EQ(comparison.error(map_of_columns(0, 40)).missing_of_reference, 0.0);
}

TEST(MapComparison, PointsOffTheSurfaceAreInaccurateButNoGhosts) {
  SurfaceMap map = whole_map();
  for (int row = 0; row < 10; ++row) map.points.push_back(at(40, row, 1.9));
  for (int row = 0; row < 10; ++row) map.points.push_back(at(50, row, 1.5));  // nothing was there
  const MapError error = MapComparison(truth_of(wall_with_things())).error(map);
  EXPECT_DOUBLE_EQ(error.accuracy, kPoints / (kPoints + 20.0));
  EXPECT_EQ(error.ghost_points, 0U);
  EXPECT_EQ(error.completeness, 1.0);
  SurfaceMap off;
  for (const auto& point : whole_map().points) off.points.push_back(point);
  for (auto& point : off.points) point.position.z() += 0.03F;
  EXPECT_NEAR(MapComparison(truth_of(wall())).error(off).median_distance, 0.03, 1e-5);
  MapErrorOptions strict;
  strict.tolerance = 0.02;
  EXPECT_EQ(MapComparison(truth_of(wall()), strict).error(off).accuracy, 0.0);
}

TEST(MapComparison, TellsGhostsFromWhatIsParked) {
  SurfaceMap map = whole_map();
  const std::size_t ghosts = put_on(kMover, map);
  const MapComparison comparison(truth_of(wall_with_things()));
  const MapError with_ghosts = comparison.error(map);
  EXPECT_EQ(ghosts, 200U);
  EXPECT_EQ(with_ghosts.ghost_points, ghosts);
  EXPECT_DOUBLE_EQ(with_ghosts.ghosts, 200.0 / (kPoints + 200.0));
  EXPECT_DOUBLE_EQ(with_ghosts.accuracy, kPoints / (kPoints + 200.0));
  const std::size_t parked = put_on(kParked, map);
  const MapError with_both = comparison.error(map);
  EXPECT_EQ(with_both.resting_points, parked);
  EXPECT_DOUBLE_EQ(with_both.resting, 300.0 / (kPoints + 500.0));
  EXPECT_EQ(with_both.accuracy, with_ghosts.accuracy);
  EXPECT_EQ(with_both.ghosts, with_ghosts.ghosts);
}

TEST(MapComparison, CountsWhatLiesBetweenPointsWhereTrianglesAre) {
  const MapComparison comparison(truth_of(wall()));
  SurfaceMap sparse = map_of_columns(0, kColumns, 2);
  EXPECT_DOUBLE_EQ(comparison.error(sparse).completeness, 0.75);  // the middles of squares are 5.7 cm away
  const auto index = [](int column, int row) { return static_cast<std::uint32_t>(40 * row + column); };
  for (int row = 0; row + 1 < 30; ++row) {
    for (int column = 0; column + 1 < 40; ++column) {
      sparse.triangles.push_back({index(column, row), index(column, row + 1), index(column + 1, row)});
      sparse.triangles.push_back(
          {index(column + 1, row), index(column, row + 1), index(column + 1, row + 1)});
    }
  }
  // But for the last corner, which is beyond the last square.
  EXPECT_DOUBLE_EQ(comparison.error(sparse).completeness, 1.0 - 1.0 / kPoints);
}

TEST(MapComparison, TellsErrorsApartByProvenance) {
  SurfaceMap map = whole_map();
  for (std::size_t i = 0; i < 1000; ++i) {
    map.points[i].provenance = Provenance::kReprojected;
    map.points[i].colour = kPaint + cv::Vec3b(6, 0, 0);
  }
  for (std::size_t i = 1000; i < 1500; ++i) {
    map.points[i].provenance = Provenance::kInpainted;
    map.points[i].colour = kPaint - cv::Vec3b(0, 30, 30);
    if (i < 1100) map.points[i].position.z() -= 0.1F;
  }
  const std::size_t ghosts = put_on(kMover, map);
  const MapError error = MapComparison(truth_of(wall_with_things())).error(map);
  const auto& [measured, reprojected, inpainted] = error.by_provenance;
  EXPECT_EQ(measured.points, kPoints - 1500U + ghosts);
  EXPECT_EQ(measured.ghost_points, ghosts);
  EXPECT_EQ(measured.colour_error, 0.0);
  EXPECT_EQ(reprojected.provenance, Provenance::kReprojected);
  EXPECT_EQ(reprojected.points, 1000U);
  EXPECT_EQ(reprojected.accuracy, 1.0);
  EXPECT_DOUBLE_EQ(reprojected.colour_error, 2.0);
  EXPECT_EQ(inpainted.points, 500U);
  EXPECT_DOUBLE_EQ(inpainted.accuracy, 0.8);
  EXPECT_DOUBLE_EQ(inpainted.colour_error, 20.0);  // of the points that are where they should
  EXPECT_EQ(inpainted.ghost_points, 0U);
  EXPECT_DOUBLE_EQ(error.colour_error, (1000 * 2.0 + 400 * 20.0) / (kPoints - 100));
}

TEST(MapComparison, AnEmptyMapMissesAllAndSaysNothingElse) {
  const MapError error = MapComparison(truth_of(wall())).error(SurfaceMap());
  EXPECT_EQ(error.completeness, 0.0);
  EXPECT_EQ(error.holes, 1.0);
  EXPECT_EQ(error.f_score, 0.0);
  for (const double value : {error.accuracy, error.ghosts, error.resting, error.median_distance,
                             error.p90_distance, error.colour_error})
    EXPECT_TRUE(std::isnan(value));
}

TEST(MapComparison, ToleratesNoOptionsThatContradict) {
  const MapTruth truth = truth_of(wall());
  MapErrorOptions options;
  options.tolerance = 0.2;
  EXPECT_THROW(MapComparison(truth, options), OptionsError);
  options = {};
  options.ghost_reach = 0.0;
  EXPECT_THROW(MapComparison(truth, options), OptionsError);
}

TEST(MapTruth, FarThingsMayBeInAMapButNeedNot) {
  MapTruthOptions options;
  options.range = 1.5;
  const MapError error = MapComparison(truth_of(wall(), options)).error(whole_map());
  EXPECT_EQ(error.truth_points, 0U);
  EXPECT_EQ(error.accuracy, 1.0);
  EXPECT_TRUE(std::isnan(error.completeness));
}

TEST(MapTruth, KeepsWhatWasSeenFromNearest) {
  MapTruth truth(camera());
  truth.add(wall());
  truth.add(wall());
  EXPECT_EQ(truth.static_points().size(), static_cast<std::size_t>(kPoints));
  MapTruthFrame nearer = wall(1.0);
  nearer.background_colour.setTo(cv::Scalar(1, 2, 3));
  nearer.T_world_camera = SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, 1.0));
  truth.add(nearer);
  const MapComparison comparison(truth);
  SurfaceMap middle;
  middle.points = {at(40, 30)};
  middle.points[0].colour = cv::Vec3b(1, 2, 3);
  EXPECT_EQ(comparison.error(middle).colour_error, 0.0);
  SurfaceMap edge;
  edge.points = {at(2, 2)};  // which the nearer view does not see
  EXPECT_EQ(comparison.error(edge).colour_error, 0.0);
}

TEST(MapTruth, MasksTellNoiseFromWhatMoves) {
  MapTruthFrame frame = wall_with_things();
  const auto known = truth_of(frame).moving_points();
  frame.taken_depth(cv::Rect(60, 20, 20, 20)).setTo(1.6);  // noise
  EXPECT_EQ(truth_of(frame).moving_points().size(), known.size());
  frame.moving.reset();
  const auto by_depth = truth_of(frame).moving_points();
  EXPECT_EQ(by_depth.size(), known.size() + 100);
  EXPECT_FALSE(std::any_of(by_depth.begin(), by_depth.end(), [](const auto& point) { return point.rests; }));
  // In front of the sky any depth is an object.
  MapTruthFrame sky = wall_with_things();
  sky.background_depth.setTo(0.0);
  EXPECT_EQ(truth_of(sky).moving_points().size(), known.size());
  EXPECT_TRUE(truth_of(sky).static_points().empty());
}

TEST(MapTruth, WithoutColourThereIsNoErrorOfColour) {
  MapTruthFrame frame = wall();
  frame.background_colour = cv::Mat();
  EXPECT_TRUE(std::isnan(MapComparison(truth_of(frame)).error(whole_map()).colour_error));
}

TEST(MapTruth, RefusesWhatDoesNotFit) {
  MapTruth truth(camera());
  MapTruthFrame frame = wall_with_things();
  frame.taken_depth = cv::Mat(20, 30, CV_32FC1, cv::Scalar(1.0));
  EXPECT_THROW(truth.add(frame), InputError);
  frame = wall();
  frame.background_depth.convertTo(frame.background_depth, CV_16U);
  EXPECT_THROW(truth.add(frame), InputError);
  MapTruthOptions options;
  options.range = 30.0;
  EXPECT_THROW(MapTruth(camera(), options), OptionsError);
}

TEST(MapReport, ASurfaceMovedBackFitsAgain) {
  Vector6d tangent;
  tangent << 1.0, 2.0, -0.5, 0.3, -0.2, 0.9;
  const SE3 motion = SE3::exp(tangent);
  const SurfaceMap away = moved(whole_map(), motion);
  EXPECT_NEAR(away.points[0].normal.dot((motion.rotation() * -Eigen::Vector3d::UnitZ()).cast<float>()), 1.0F,
              1e-5F);
  const MapComparison comparison(truth_of(wall()));
  EXPECT_LT(comparison.error(away).accuracy, 0.1);
  EXPECT_EQ(comparison.error(moved(away, motion.inverse())).accuracy, 1.0);
}

TEST(MapReport, HoldsEveryFigureAndNullWhereThereIsNone) {
  const MapComparison comparison(truth_of(wall()));
  const std::vector<EvaluatedMap> maps{{"good", 0.01, comparison.error(whole_map())},
                                       {"empty", 0.02, comparison.error(SurfaceMap())}};
  const auto json = nlohmann::json::parse(to_json(maps, {}, {}));
  EXPECT_EQ(json.at("tolerance_m"), 0.05);
  const auto& good = json.at("estimates").at(0);
  const auto& empty = json.at("estimates").at(1);
  EXPECT_EQ(good.at("name"), "good");
  EXPECT_EQ(good.at("trajectory_rmse_m"), 0.01);
  EXPECT_EQ(good.at("f_score"), 1.0);
  EXPECT_EQ(good.at("hole_share"), 0.0);
  EXPECT_TRUE(good.at("missing_of_reference").is_null());
  EXPECT_EQ(good.at("by_provenance").at(0).at("provenance"), "measured");
  EXPECT_EQ(good.at("by_provenance").at(0).at("points"), kPoints);
  EXPECT_TRUE(good.at("by_provenance").at(2).at("accuracy").is_null());
  EXPECT_TRUE(empty.at("accuracy").is_null());
  EXPECT_TRUE(empty.at("ghost_share").is_null());
  EXPECT_EQ(empty.at("completeness"), 0.0);
  const std::string table = to_markdown(maps);
  EXPECT_NE(table.find(" good |"), std::string::npos) << table;
  EXPECT_NE(table.find("| good, measured "), std::string::npos) << table;
}

}  // namespace
}  // namespace roslam
