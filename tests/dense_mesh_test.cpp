// SPDX-License-Identifier: BSD-3-Clause
// The mesh of the dense map is an oriented manifold, whatever the surfaces and the noise.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <opencv2/core.hpp>
#include <random>
#include <set>
#include <utility>

#include "roslam/dense/surface_map.hpp"
#include "roslam/dense/tsdf_volume.hpp"
#include "tests/dense_scene.hpp"

namespace {
using namespace roslam;
using Eigen::Vector3d;
using Eigen::Vector3f;

// The signed distance to the surfaces of a scene, metres.
using Scene = std::function<double(const Vector3d&)>;

Scene sphere(const Vector3d& centre, double radius) {
  return [=](const Vector3d& at) { return (at - centre).norm() - radius; };
}

Scene box(const Vector3d& centre, const Vector3d& half) {
  return [=](const Vector3d& at) {
    const Vector3d out = (at - centre).cwiseAbs() - half;
    return out.cwiseMax(0.0).norm() + std::min(out.maxCoeff(), 0.0);
  };
}

Scene both(const Scene& a, const Scene& b) {
  return [=](const Vector3d& at) { return std::min(a(at), b(at)); };
}

// Seen from inside.
Scene room(double radius) {
  return [=](const Vector3d& at) { return radius - at.norm(); };
}

const Scene kSphere = sphere(Vector3d::Zero(), 0.8);
const Scene kBox = box({0.01, 0.02, 0.03}, {0.5, 0.6, 0.7});
const Scene kThinWall = box({0.0, 0.01, 0.0}, {0.8, 0.03, 0.8});
const Scene kTwoWalls = both(box({0.0, -0.15, 0.0}, {0.7, 0.1, 0.7}), box({0.0, 0.11, 0.0}, {0.7, 0.1, 0.7}));
const Scene kTwoSpheres = both(sphere({-0.42, 0.0, 0.0}, 0.4), sphere({0.42, 0.03, 0.0}, 0.4));
const Scene kShelf =
    both(both(kThinWall, sphere({0.2, 0.3, 0.1}, 0.2)), box({0.0, -0.3, 0.2}, {0.5, 0.3, 0.03}));

cv::Mat depth_of(const Scene& scene, const SE3& T_world_camera, const Camera& camera) {
  constexpr double kFarthest = 9.0, kClose = 1e-4;  // metres
  cv::Mat depth = cv::Mat::zeros(camera.height, camera.width, CV_32FC1);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Vector3d unit = camera.unproject({x, y}, 1.0);
      const Vector3d ray = T_world_camera.rotation() * unit.normalized();
      double way = 0.0, left = 1.0;
      while (left > kClose && way < kFarthest) {
        left = scene(T_world_camera.translation() + way * ray);
        way += left;
      }
      if (way < kFarthest) depth.at<float>(y, x) = static_cast<float>(way / unit.norm());
    }
  }
  return depth;
}

// The mesh of views from all around the origin. noise: metres, of depth and of the position of the camera.
SurfaceMap mesh_of(const Scene& scene, double noise, double min_weight = 0.1) {
  constexpr int kViews = 20;
  constexpr double kGoldenAngle = 2.399963, kRange = 2.2;  // radians, metres
  DenseOptions options = dense_scene::options();
  options.stride = 1;
  options.min_weight = min_weight;
  Camera camera;
  camera.width = 160;
  camera.height = 120;
  camera.fx = camera.fy = 130.0;
  camera.cx = 79.5;
  camera.cy = 59.5;
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 1.0);
  TsdfVolume volume(options.voxel_size, options, {});
  for (int i = 0; i < kViews; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kViews, r = std::sqrt(1.0 - z * z);
    const Vector3d from(r * std::cos(kGoldenAngle * i), r * std::sin(kGoldenAngle * i), z);
    const SE3 pose(Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), -from), kRange * from);
    cv::Mat depth = depth_of(scene, pose, camera);
    for (float& value : cv::Mat_<float>(depth))
      if (value > 0.0F) value += static_cast<float>(noise * normal(random));
    const cv::Mat colour(depth.size(), CV_8UC3, cv::Scalar(40, 80, 120));
    const Vector3d off = noise * Vector3d(normal(random), normal(random), normal(random));
    volume.integrate(dense_scene::view({colour, depth}, camera, options),
                     SE3(pose.rotation(), pose.translation() + off));
  }
  return extract_surface(volume, options);
}

// How often triangles run along each edge, in each direction.
std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges_of(const SurfaceMap& surface) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : surface.triangles)
    for (std::size_t i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  return edges;
}

void expect_oriented_manifold(const SurfaceMap& surface) {
  ASSERT_GT(surface.triangles.size(), 2000U);
  // Once in each direction, so in at most two triangles, which agree on the side that is free.
  std::size_t in_too_many = 0, flat = 0, against = 0;
  for (const auto& [edge, count] : edges_of(surface))
    if (count > 1) ++in_too_many;
  std::set<std::array<std::uint32_t, 3>> distinct;
  for (auto t : surface.triangles) {
    const auto point = [&](std::size_t i) { return surface.points[t[i]]; };
    const Vector3f area =
        (point(1).position - point(0).position).cross(point(2).position - point(0).position);
    if (!(area.norm() > 1e-10F)) ++flat;
    if (!(area.dot(point(0).normal + point(1).normal + point(2).normal) > 0.0F)) ++against;
    std::sort(t.begin(), t.end());
    distinct.insert(t);
  }
  EXPECT_EQ(in_too_many, 0U);
  EXPECT_EQ(flat, 0U);
  EXPECT_EQ(against, 0U);
  EXPECT_EQ(distinct.size(), surface.triangles.size());
  for (const SurfacePoint& point : surface.points) ASSERT_NEAR(point.normal.norm(), 1.0F, 1e-4F);
}

class DenseMeshOf : public testing::TestWithParam<double> {};

TEST_P(DenseMeshOf, IsAnOrientedManifold) {
  for (const Scene& scene : {kSphere, kBox, kThinWall, kTwoWalls, kTwoSpheres, kShelf})
    expect_oriented_manifold(mesh_of(scene, GetParam()));
}

INSTANTIATE_TEST_SUITE_P(Noise, DenseMeshOf, testing::Values(0.0, 0.01, 0.02));

TEST(DenseMesh, HasNoHolesWhereAllIsSeen) {
  for (const Scene& scene : {kSphere, kBox}) {
    const SurfaceMap surface = mesh_of(both(scene, room(2.9)), 0.0, 0.0);
    const auto edges = edges_of(surface);
    std::size_t open = 0, all = 0;
    for (const auto& [edge, count] : edges) {
      const Vector3d at = surface.points[edge.first].position.cast<double>();
      if (std::abs(scene(at)) > 0.03) continue;
      ++all;
      if (!edges.contains({edge.second, edge.first})) ++open;
    }
    EXPECT_GT(all, 5000U);
    EXPECT_LT(open, all / 500);  // where an edge ends too deep behind the surface
  }
}

// Each patch of a cube has a point of its own, so none lies between two surfaces.
TEST(DenseMesh, KeepsSurfacesApart) {
  const SurfaceMap surface = mesh_of(kTwoSpheres, 0.0);
  std::map<std::array<int, 3>, int> cubes;
  for (const SurfacePoint& point : surface.points) {
    const Eigen::Vector3i cube = (point.position.array() / 0.05F - 0.5F).floor().cast<int>();
    ++cubes[{cube[0], cube[1], cube[2]}];
  }
  EXPECT_GT(std::count_if(cubes.begin(), cubes.end(), [](const auto& cube) { return cube.second > 1; }), 0);
}
}  // namespace
