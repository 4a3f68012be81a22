// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>

#include "roslam/dense/local_planes.hpp"
#include "roslam/dense/surface_map.hpp"
#include "roslam/dense/tsdf_volume.hpp"
#include "roslam/dense/visibility_check.hpp"
#include "tests/dense_scene.hpp"

namespace {
using namespace roslam;
using dense_scene::kFloor;
using dense_scene::kWall;
using dense_scene::Slab;

const Slab kThing{2, 2.0, {-0.5, -0.5, -9}, {0.5, 0.9, 9}, {0, 0, 250}};

VoxelReading reading(float distance, Provenance provenance = Provenance::kMeasured,
                     std::uint8_t label = kVoid) {
  return {distance, 1.0F, {10, 20, 30}, label, provenance};
}

TsdfVolume fused(const std::vector<Slab>& slabs, const std::vector<SE3>& poses) {
  TsdfVolume map(0.05, dense_scene::options(), {});
  const Camera camera = scene::small_camera();
  for (const SE3& pose : poses)
    map.integrate(dense_scene::view(dense_scene::show(slabs, pose, camera), camera), pose);
  return map;
}

std::size_t points_on(const SurfaceMap& surface, const Slab& slab, double tolerance) {
  return static_cast<std::size_t>(
      std::count_if(surface.points.begin(), surface.points.end(), [&](const auto& p) {
        const Eigen::Vector3d at = p.position.template cast<double>();
        return std::abs(at[slab.axis] - slab.at) < tolerance &&
               (at.array() >= slab.low.array() - tolerance).all() &&
               (at.array() <= slab.high.array() + tolerance).all();
      }));
}

TEST(LocalPlanes, AreExactOnATiltedPlane) {
  const Camera camera = scene::small_camera();
  const SE3 pose(so3_exp({0.3, 0.6, 0.1}), {0.2, 0.1, 0.3});
  const auto image = dense_scene::show({kWall}, pose, camera);
  const cv::Mat planes = local_planes(image.depth, camera);
  const Eigen::Vector3d normal = pose.rotation().conjugate() * Eigen::Vector3d::UnitZ();
  for (int y = 10; y < camera.height; y += 50) {
    for (int x = 10; x < camera.width; x += 50) {
      if (image.depth.at<float>(y, x) == 0.0F) continue;  // beyond the end of the wall
      const auto& plane = planes.at<cv::Vec4f>(y, x);
      EXPECT_NEAR(normal.dot(Eigen::Vector3d(plane[0], plane[1], plane[2])), 1.0, 1e-4);
      EXPECT_NEAR(plane[3], 3.7, 2e-3);
    }
  }
}

TEST(LocalPlanes, DoNotReachAcrossAnEdge) {
  const Camera camera = scene::small_camera();
  const auto image = dense_scene::show({kWall, kThing}, SE3(), camera);
  const cv::Mat planes = local_planes(image.depth, camera);
  for (int x = 0; x < camera.width; ++x) {
    const auto& plane = planes.at<cv::Vec4f>(120, x);
    EXPECT_NEAR(plane[2], 1.0F, 1e-4F);
    EXPECT_NEAR(plane[3], image.depth.at<float>(120, x), 1e-3F);
  }
}

TEST(Voxel, TakesTheMean) {
  Voxel voxel;
  EXPECT_FALSE(voxel.is_known());
  voxel.add(reading(0.5F));
  voxel.add(reading(-0.1F));
  EXPECT_NEAR(voxel.distance(), 0.2F, 1e-3F);
  EXPECT_NEAR(voxel.weight(), 2.0F, 0.01F);
  EXPECT_NEAR(voxel.colour()[2], 30.0F, 0.1F);
}

TEST(Voxel, DropsWhatWasInventedOnceItWasSeen) {
  for (const Provenance seen : {Provenance::kMeasured, Provenance::kReprojected}) {
    Voxel voxel;
    for (int i = 0; i < 20; ++i) voxel.add(reading(-0.5F, Provenance::kInpainted));
    EXPECT_EQ(voxel.provenance(), Provenance::kInpainted);
    voxel.add(reading(0.3F, seen));
    EXPECT_EQ(voxel.provenance(), seen);
    EXPECT_NEAR(voxel.distance(), 0.3F, 1e-3F);
    voxel.add(reading(-0.5F, Provenance::kInpainted));
    EXPECT_NEAR(voxel.distance(), 0.3F, 1e-3F);
  }
}

TEST(Voxel, IsOfTheBestProvenanceOfItsSurface) {
  Voxel voxel;
  voxel.add(reading(1.0F));  // free: tells nothing of the surface
  voxel.add(reading(0.2F, Provenance::kReprojected));
  EXPECT_EQ(voxel.provenance(), Provenance::kReprojected);
  voxel.add(reading(0.2F));
  EXPECT_EQ(voxel.provenance(), Provenance::kMeasured);
  voxel.add(reading(0.2F, Provenance::kReprojected));
  EXPECT_EQ(voxel.provenance(), Provenance::kMeasured);
}

TEST(Voxel, IsCarvedByRaysThatPassThroughAndKeptByThoseThatPassBefore) {
  Voxel inside, before;
  inside.add(reading(-0.4F));
  before.add(reading(0.4F));
  for (int i = 0; i < 3; ++i) {
    inside.add(reading(1.0F));
    before.add(reading(1.0F));
  }
  EXPECT_GT(inside.distance(), 0.0F);
  EXPECT_NEAR(before.distance(), 0.4F, 1e-3F);
}

TEST(Voxel, TakesTheLabelOfTheMajority) {
  Voxel voxel;
  for (const std::uint8_t label : std::to_array<std::uint8_t>({3, 7, 7, 255, 3, 7, 7}))
    voxel.add(reading(0.1F, Provenance::kMeasured, label));
  EXPECT_EQ(voxel.label(), 7);
}

TEST(TsdfVolume, HasTheSurfacesWhereTheyAre) {
  const TsdfVolume map = fused({kWall, kFloor}, dense_scene::walk(6));
  const SurfaceMap surface = extract_surface(map, {});
  ASSERT_GT(surface.points.size(), 5000U);
  std::size_t rough = 0;
  for (const SurfacePoint& point : surface.points) {
    // In the corner of the room distances to two planes mix.
    if (point.position.z() > 3.8F && point.position.y() > 1.0F) continue;
    const double off = dense_scene::distance(point.position, {kWall, kFloor});
    const bool is_floor = std::abs(point.position.y() - 1.2F) < 0.02F;
    const Eigen::Vector3f normal = is_floor ? -Eigen::Vector3f::UnitY() : -Eigen::Vector3f::UnitZ();
    EXPECT_LT(off, 0.015);
    EXPECT_GT(normal.dot(point.normal), 0.85F);
    if (off > 0.003 || normal.dot(point.normal) < 0.98F) ++rough;
    EXPECT_LT(cv::norm(cv::Vec3i(point.colour), cv::Vec3i(is_floor ? kFloor.colour : kWall.colour)), 12.0);
  }
  // At the border of the observed area.
  EXPECT_LT(rough, surface.points.size() / 50);
}

TEST(TsdfVolume, HasAFloorSeenAtAFlatAngleWithoutHoles) {
  const TsdfVolume map = fused({kFloor}, {SE3()});
  DenseOptions options;
  options.min_weight = 0.0;
  const SurfaceMap surface = extract_surface(map, options);
  // From 2 to 7 metres ahead, 1.2 m below the camera, a point for each voxel.
  std::size_t found = 0;
  for (const SurfacePoint& point : surface.points)
    if (point.position.z() > 3.0F && point.position.z() < 7.0F && std::abs(point.position.x()) < 1.0F)
      ++found;
  EXPECT_GT(found, 0.97 * (4.0 / 0.05) * (2.0 / 0.05));
}

TEST(SurfaceMap, HasTrianglesThatFaceFreeSpaceAndJoin) {
  const TsdfVolume map = fused({kWall, kFloor}, dense_scene::walk(4));
  const SurfaceMap surface = extract_surface(map, {});
  ASSERT_GT(surface.triangles.size(), surface.points.size());
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : surface.triangles) {
    const auto at = [&](std::size_t i) { return surface.points[t[i]].position; };
    const Eigen::Vector3f normal = (at(1) - at(0)).cross(at(2) - at(0));
    const bool is_corner = at(0).z() > 3.7F && at(0).y() > 0.9F;
    if (!is_corner && normal.norm() > 1e-6F) {
      EXPECT_GT(normal.normalized().dot(surface.points[t[0]].normal), 0.5F);
    }
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  // Each edge at most once in each direction: triangles agree on which side is which.
  for (const auto& [edge, count] : edges) EXPECT_EQ(count, 1);
}

TEST(SurfaceMap, LosesPointsWithTheirTriangles) {
  SurfaceMap surface;
  surface.points.resize(4);
  surface.triangles = {{0, 1, 2}, {1, 2, 3}};
  const SurfaceMap rest = filter_points(surface, {false, true, true, true});
  EXPECT_EQ(rest.points.size(), 3U);
  ASSERT_EQ(rest.triangles.size(), 1U);
  EXPECT_EQ(rest.triangles[0], (std::array<std::uint32_t, 3>{0, 1, 2}));
}

TEST(TsdfVolume, IsRidOfWhatLaterViewsLookThrough) {
  TsdfVolume map = fused({kWall, kFloor, kThing}, {SE3()});
  ASSERT_GT(points_on(extract_surface(map, {}), kThing, 0.06), 100U);
  const Camera camera = scene::small_camera();
  for (int i = 0; i < 4; ++i)
    map.integrate(dense_scene::view(dense_scene::show({kWall, kFloor}, SE3(), camera), camera), SE3());
  EXPECT_EQ(points_on(extract_surface(map, {}), kThing, 0.06), 0U);
}

TEST(VisibilityCheck, FindsWhatEarlierViewsLookedThrough) {
  const Camera camera = scene::small_camera();
  const DepthKeyframe empty = dense_scene::view(dense_scene::show({kWall, kFloor}, SE3(), camera), camera);
  const DepthKeyframe ghost =
      dense_scene::view(dense_scene::show({kWall, kFloor, kThing}, SE3(), camera), camera);
  TsdfVolume map(0.05, dense_scene::options(), {});
  for (const DepthKeyframe* view : {&empty, &empty, &ghost}) map.integrate(*view, SE3());
  const SurfaceMap surface = extract_surface(map, {});
  ASSERT_GT(points_on(surface, kThing, 0.06), 100U);
  VisibilityCheck check(surface, 0.05, {});
  for (const DepthKeyframe* view : {&empty, &empty, &ghost}) check.ask(*view, SE3());
  const SurfaceMap rest = filter_points(surface, check.confirmed());
  EXPECT_EQ(points_on(rest, kThing, 0.06), 0U);
  EXPECT_EQ(points_on(rest, kWall, 0.02), points_on(surface, kWall, 0.02));
}

TEST(VisibilityCheck, CountsViewsThatSeeSomethingBeyondTheirReach) {
  const Camera camera = scene::small_camera();
  DenseOptions options = dense_scene::options();
  options.max_depth = 3.0;  // the wall is 4 m away
  const auto view = [&](const std::vector<dense_scene::Slab>& slabs) {
    return dense_scene::view(dense_scene::show(slabs, SE3(), camera), camera, options);
  };
  const DepthKeyframe empty = view({kWall, kFloor}), ghost = view({kWall, kFloor, kThing});
  TsdfVolume map(0.05, options, {});
  map.integrate(ghost, SE3());
  const SurfaceMap surface = extract_surface(map, {});
  ASSERT_GT(points_on(surface, kThing, 0.06), 100U);
  VisibilityCheck check(surface, 0.05, {});
  for (const DepthKeyframe* asked : {&empty, &ghost, &empty}) check.ask(*asked, SE3());
  const SurfaceMap rest = filter_points(surface, check.confirmed());
  EXPECT_EQ(points_on(rest, kThing, 0.06), 0U);
  EXPECT_EQ(points_on(rest, kFloor, 0.02), points_on(surface, kFloor, 0.02));
}

// Two keyframes inpainted the wall, one an object in front. Inpainted depth never overrules seen surfaces.
TEST(VisibilityCheck, LetsInventionsOutvoteEachOther) {
  const Camera camera = scene::small_camera();
  const auto ask = [&](Provenance provenance) {
    const auto view = [&](const std::vector<dense_scene::Slab>& slabs, Provenance of) {
      return dense_scene::view(dense_scene::show(slabs, SE3(), camera), camera, dense_scene::options(), of);
    };
    const DepthKeyframe wall = view({kWall, kFloor}, Provenance::kInpainted);
    const DepthKeyframe thing = view({kWall, kFloor, kThing}, provenance);
    TsdfVolume map(0.05, dense_scene::options(), {});
    map.integrate(thing, SE3());
    const SurfaceMap surface = extract_surface(map, {});
    EXPECT_GT(points_on(surface, kThing, 0.06), 100U);
    VisibilityCheck check(surface, 0.05, {});
    for (const DepthKeyframe* asked : {&wall, &thing, &wall}) check.ask(*asked, SE3());
    const SurfaceMap rest = filter_points(surface, check.confirmed());
    EXPECT_GT(points_on(rest, kWall, 0.02), 100U);
    return std::pair(points_on(rest, kThing, 0.06), points_on(surface, kThing, 0.06));
  };
  EXPECT_EQ(ask(Provenance::kInpainted).first, 0U);
  const auto [left, all] = ask(Provenance::kMeasured);
  EXPECT_EQ(left, all);
}
}  // namespace
