// SPDX-License-Identifier: BSD-3-Clause
// Occupied, free and unknown cells of keyframes and surfaces with ground truth.
#include "roslam/occupancy/occupancy_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "roslam/common/error.hpp"
#include "roslam/occupancy/ray_carving.hpp"
#include "tests/dense_scene.hpp"

namespace {
using namespace roslam;
using dense_scene::Slab;

constexpr double kCell = 0.1;  // metres

const Slab kFacing{2, 4.03, {-9, -9, -9}, {9, 9, 9}, {40, 80, 160}};

DepthKeyframe view_of(const Slab& slab, const SE3& pose, Provenance provenance = Provenance::kMeasured) {
  const Camera camera = scene::small_camera();
  return dense_scene::view(dense_scene::show({slab}, pose, camera), camera, dense_scene::options(),
                           provenance);
}

SurfaceMap points(const std::vector<Eigen::Vector3f>& positions) {
  SurfaceMap surface;
  for (const auto& position : positions)
    surface.points.push_back({position, Eigen::Vector3f::UnitZ(), {1, 2, 3}});
  return surface;
}

SurfaceMap wall(float z) {
  std::vector<Eigen::Vector3f> positions;
  for (int y = -60; y <= 60; ++y)
    for (int x = -60; x <= 60; ++x)
      positions.emplace_back(0.05F * static_cast<float>(x), 0.05F * static_cast<float>(y), z);
  return points(positions);
}

// The centre of a cell.
Eigen::Vector3d centre(int x, int y, int z, double side = kCell) {
  return (Eigen::Vector3d(x, y, z).array() + 0.5) * side;
}

// Whether all of a cell is in the image of a camera at the origin, or none of it.
enum class Sight { kAll, kNone, kSome };
Sight sight(const Camera& camera, const Eigen::Vector3d& middle, double side) {
  int inside = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d at =
        middle + (Eigen::Vector3d(corner & 1, corner >> 1 & 1, corner >> 2).array() - 0.5).matrix() * side;
    if (at.z() <= 0.0) continue;
    const Eigen::Vector2d pixel = camera.project(at);
    if (pixel.x() > 0.0 && pixel.y() > 0.0 && pixel.x() < camera.width - 1 && pixel.y() < camera.height - 1)
      ++inside;
  }
  return inside == 8 ? Sight::kAll : inside == 0 ? Sight::kNone : Sight::kSome;
}

TEST(OccupancyMap, IsFreeBeforeAWallOccupiedAtItAndUnknownBehind) {
  OccupancyMap space(kCell);
  const DepthKeyframe view = view_of(kFacing, SE3());
  space.add_view(view, SE3());
  space.add_surface(wall(4.03F));
  int free = 0;
  for (int z = -5; z < 60; ++z) {
    for (int y = -25; y < 25; ++y) {
      for (int x = -30; x < 30; ++x) {
        const Eigen::Vector3d at = centre(x, y, z);
        const Sight seen = sight(view.camera, at, kCell);
        if (z > 40 || (seen == Sight::kNone && z < 40 && (z < 0 || at.head<2>().norm() > 0.3))) {
          ASSERT_EQ(space.at(at), OccupancyState::kUnknown) << at.transpose();
        } else if (z == 40) {
          ASSERT_EQ(space.at(at), OccupancyState::kOccupied) << at.transpose();
        } else if (seen == Sight::kAll) {
          ASSERT_EQ(space.at(at), OccupancyState::kFree) << at.transpose();
          ++free;
        }
      }
    }
  }
  EXPECT_GT(free, 10000);
  // The viewing pyramid up to the wall.
  const double pyramid = 4.0 * (4.0 * 320 / 260) * (4.0 * 240 / 260) / 3.0;
  EXPECT_NEAR(space.free_volume(), pyramid, 0.1 * pyramid);
  EXPECT_NEAR(space.occupied_volume(), 61 * 61 * 1e-3, 0.2);
}

TEST(OccupancyMap, TakesNothingForFreeThatNobodyMeasured) {
  for (const Provenance provenance : {Provenance::kInpainted, Provenance::kReprojected}) {
    OccupancyMap space(kCell);
    space.add_view(view_of(kFacing, SE3(), provenance), SE3());
    EXPECT_EQ(space.free_volume(), 0.0);
  }
  DepthKeyframe half = view_of(kFacing, SE3());
  half.provenance.colRange(0, half.provenance.cols / 2).setTo(static_cast<double>(Provenance::kInpainted));
  DepthKeyframe blind = view_of(kFacing, SE3());
  blind.depth.setTo(0.0);
  OccupancyMap space(kCell);
  space.add_view(blind, SE3());
  EXPECT_EQ(space.free_volume(), 0.0);
  space.add_view(half, SE3());
  EXPECT_EQ(space.at({0.6, 0.0, 2.0}), OccupancyState::kFree);
  EXPECT_EQ(space.at({-0.6, 0.0, 2.0}), OccupancyState::kUnknown);
}

// All surfaces lie beyond the fusion range: space is free up to it.
TEST(OccupancyMap, IsFreeUpToTheReachWhereAllIsFarther) {
  const Camera camera = scene::small_camera();
  DenseOptions options = dense_scene::options();
  options.max_depth = 2.0;
  const auto image = dense_scene::show({kFacing}, SE3(), camera);
  OccupancyMap space(kCell);
  space.add_view(dense_scene::view(image, camera, options), SE3());
  for (int z = 3; z < 20; ++z) EXPECT_EQ(space.at(centre(0, 0, z)), OccupancyState::kFree) << z;
  for (int z = 20; z < 45; ++z) EXPECT_EQ(space.at(centre(0, 0, z)), OccupancyState::kUnknown) << z;
  OccupancyMap invented(kCell);
  invented.add_view(dense_scene::view(image, camera, options, Provenance::kInpainted), SE3());
  EXPECT_EQ(invented.free_volume(), 0.0);
}

TEST(OccupancyMap, IsOccupiedWhereAPointIsWhateverComesFirst) {
  const SurfaceMap thing = points({{0.05F, 0.05F, 2.05F}, {0.05F, 0.15F, 2.05F}});
  OccupancyMap before(kCell), after(kCell);
  before.add_surface(thing);
  before.add_view(view_of(kFacing, SE3()), SE3());
  after.add_view(view_of(kFacing, SE3()), SE3());
  EXPECT_EQ(after.at({0.05, 0.05, 2.05}), OccupancyState::kFree);
  after.add_surface(thing);
  for (const OccupancyMap* space : {&before, &after}) {
    EXPECT_EQ(space->at({0.05, 0.05, 2.05}), OccupancyState::kOccupied);
    EXPECT_EQ(space->at({0.05, 0.15, 2.05}), OccupancyState::kOccupied);
    EXPECT_EQ(space->at({0.05, 0.25, 2.05}), OccupancyState::kFree);
    EXPECT_NEAR(space->occupied_volume(), 2e-3, 1e-9);
  }
  EXPECT_NEAR(before.free_volume(), after.free_volume(), 1e-9);
}

// At grazing angles, rays to farther points pass through occupied cells of a floor.
TEST(OccupancyMap, TakesNoCellForFreeThatAReadingLiesIn) {
  const DepthKeyframe view = view_of({1, 1.25}, SE3());
  OccupancyMap space(kCell);
  space.add_view(view, SE3());
  EXPECT_GT(space.free_volume(), 1.0);
  int readings = 0;
  for (int y = 0; y < view.depth.rows; ++y) {
    for (int x = 0; x < view.depth.cols; ++x) {
      const double depth = static_cast<double>(view.depth.at<float>(y, x));
      if (depth == 0.0) continue;
      ASSERT_EQ(space.at(view.camera.unproject({x, y}, depth)), OccupancyState::kUnknown);
      ++readings;
    }
  }
  EXPECT_GT(readings, 1000);
}

// A view of one pixel is one ray.
TEST(OccupancyMap, FreesTheCellsOfARayAndNoOthers) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  for (int i = 0; i < 200; ++i) {
    const SE3 pose(so3_exp({3.0 * number(random), 3.0 * number(random), 3.0 * number(random)}),
                   {5.0 * number(random), 5.0 * number(random), 5.0 * number(random)});
    const double depth = 2.0 + number(random);
    DepthKeyframe view{scene::small_camera(), cv::Mat(1, 1, CV_8UC3),
                       cv::Mat(1, 1, CV_32FC1, cv::Scalar(depth)), cv::Mat(1, 1, CV_8UC1),
                       cv::Mat::zeros(1, 1, CV_8UC1)};
    view.camera.cx = view.camera.cy = 0.0;
    OccupancyMap space(kCell);
    space.add_view(view, pose);
    const Eigen::Vector3d end = pose * Eigen::Vector3d(0, 0, static_cast<double>(static_cast<float>(depth)));
    Eigen::Vector3i cell, last;
    ASSERT_TRUE(find_cell(end, 1.0 / kCell, last));
    std::set<std::array<int, 3>> passed;
    for (int s = 0; s <= 100000; ++s) {
      const double share = s / 100000.0;
      ASSERT_TRUE(find_cell((1.0 - share) * pose.translation() + share * end, 1.0 / kCell, cell));
      if (cell == last) continue;
      passed.insert({cell.x(), cell.y(), cell.z()});
      ASSERT_EQ(space.at(centre(cell.x(), cell.y(), cell.z())), OccupancyState::kFree);
    }
    EXPECT_EQ(space.at(end), OccupancyState::kUnknown);
    // Corners that a ray cuts may fall between samples.
    EXPECT_NEAR(space.free_volume() / std::pow(kCell, 3), static_cast<double>(passed.size()), 1.01);
  }
}

TEST(OccupancyMap, MergesWhatIsAlikeAndKeepsWhatIsNot) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> place(-20, 20);
  std::set<std::array<int, 3>> cells;
  for (int z = -8; z < 8; ++z)  // whole blocks
    for (int y = -8; y < 8; ++y)
      for (int x = -8; x < 8; ++x) cells.insert({x, y, z});
  for (int i = 0; i < 500; ++i) cells.insert({place(random), place(random), place(random)});
  std::vector<Eigen::Vector3f> positions;
  for (const auto& [x, y, z] : cells) positions.push_back(centre(x, y, z).cast<float>());
  std::shuffle(positions.begin(), positions.end(), random);
  OccupancyMap space(kCell);
  const auto half = positions.begin() + static_cast<std::ptrdiff_t>(positions.size() / 2);
  space.add_surface(points({positions.begin(), half}));
  space.add_surface(points({half, positions.end()}));
  EXPECT_NEAR(space.occupied_volume(), static_cast<double>(cells.size()) * 1e-3, 1e-6);
  for (int z = -21; z <= 21; ++z)
    for (int y = -21; y <= 21; ++y)
      for (int x = -21; x <= 21; ++x)
        ASSERT_EQ(space.at(centre(x, y, z)) == OccupancyState::kOccupied, cells.contains({x, y, z}));
}

TEST(OccupancyMap, TakesOverWhatIsFreeInAnother) {
  OccupancyMap seen(kCell);
  seen.add_view(view_of(kFacing, SE3()), SE3());
  seen.add_surface(points({{0.05F, 0.05F, 1.05F}}));
  for (const double side : {kCell, 0.04, 0.25}) {
    OccupancyMap space(side);
    space.add_surface(points({{0.05F, 0.05F, 2.05F}}));
    space.free_from(seen);
    EXPECT_EQ(space.at({0.05, 0.05, 2.05}), OccupancyState::kOccupied) << side;
    EXPECT_NEAR(space.free_volume(), seen.free_volume(), 0.05 * seen.free_volume()) << side;
    for (int z = 0; z < 20; ++z) {
      for (int y = -10; y < 10; ++y) {
        for (int x = -10; x < 10; ++x) {
          const Eigen::Vector3d at = centre(x, y, z, side);
          if (space.at(at) == OccupancyState::kOccupied) continue;
          ASSERT_EQ(space.at(at) == OccupancyState::kFree, seen.at(at) == OccupancyState::kFree)
              << side << " " << at.transpose();
        }
      }
    }
  }
}

TEST(OccupancyMap, HasCoarseCellsWhereAsked) {
  OccupancyMap space(0.5);
  space.add_view(view_of(kFacing, SE3()), SE3());
  space.add_surface(wall(4.03F));
  EXPECT_EQ(space.at({0.1, 0.1, 3.4}), OccupancyState::kFree);
  EXPECT_EQ(space.at({0.1, 0.1, 4.4}), OccupancyState::kOccupied);  // in the cell of the wall
  EXPECT_EQ(space.at({0.1, 0.1, 4.6}), OccupancyState::kUnknown);
}

TEST(OccupancyMap, RefusesCellsThatNobodyHasAndPointsTooFarAway) {
  for (const double side : {0.0, -0.1, 0.0001, 11.0, std::nan("")})
    EXPECT_THROW(OccupancyMap{side}, OptionsError);
  OccupancyMap space(0.001);
  EXPECT_THROW(space.add_surface(points({{40.0F, 0.0F, 0.0F}})), OptionsError);
  EXPECT_EQ(space.at({1e30, 0.0, 0.0}), OccupancyState::kUnknown);
  EXPECT_EQ(space.at(Eigen::Vector3d::Constant(std::nan(""))), OccupancyState::kUnknown);
  const SE3 far(Eigen::Quaterniond::Identity(), {0.0, 0.0, 1e6});
  space.add_view(view_of({2, 1e6 + 4.0}, far), far);
  EXPECT_EQ(space.free_volume(), 0.0);
}

TEST(OccupancyMap, OfADenseMapIsFreeWhereItsViewsLookedThrough) {
  DenseMapper mapper(dense_scene::options(), {});
  constexpr SubmapId kHere{0}, kElsewhere{1};
  std::uint32_t id = 0;
  for (const SE3& pose : dense_scene::walk(5)) mapper.insert({id++}, view_of(kFacing, pose), {kHere, pose});
  mapper.insert({id}, view_of(kFacing, SE3()), {kElsewhere, scene::turned(2.0)});
  const SurfaceMap surface = mapper.surface(kHere);
  const OccupancyMap space = occupancy_map_of(mapper, kHere, surface, 0.0);
  EXPECT_EQ(space.resolution(), 0.1);
  for (const SurfacePoint& point : surface.points)
    ASSERT_EQ(space.at(point.position.cast<double>()), OccupancyState::kOccupied);
  for (const double z : {0.5, 1.5, 2.5, 3.5}) EXPECT_EQ(space.at({0.1, 0.0, z}), OccupancyState::kFree) << z;
  EXPECT_EQ(space.at({0.1, 0.0, 5.0}), OccupancyState::kUnknown);
  EXPECT_EQ(space.at({0.1, 0.0, -1.0}), OccupancyState::kUnknown);  // the other world looks there
  EXPECT_EQ(occupancy_map_of(mapper, kHere, surface, 0.25).resolution(), 0.25);
  EXPECT_EQ(occupancy_map_of(mapper, SubmapId{7}, {}, 0.0).free_volume(), 0.0);
}
}  // namespace
