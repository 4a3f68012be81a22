// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/cloud/dense_mapper.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "tests/removal_scene.hpp"

/// A room of flat things that the dense map is built of, seen by the small camera of removal_scene.hpp.
namespace roslam::cloud_scene {

/// A rectangle across an axis of the world.
struct Slab {
  int axis = 2;     ///< that it is across
  double at = 4.0;  ///< metres along that axis
  Eigen::Vector3d low{-9, -9, -9}, high{9, 9, 9};
  cv::Vec3b colour{40, 80, 120};
};

inline const Slab kWall{2, 4.0, {-9, -9, -9}, {9, 9, 9}, {40, 80, 160}};
inline const Slab kFloor{1, 1.2, {-9, -9, -9}, {9, 9, 9}, {120, 120, 60}};

struct Picture {
  cv::Mat colour, depth;
};

/// What a camera without distortion sees.
inline Picture show(const std::vector<Slab>& slabs, const SE3& T_world_camera, const Camera& camera) {
  Picture picture{cv::Mat::zeros(camera.height, camera.width, CV_8UC3),
                  cv::Mat::zeros(camera.height, camera.width, CV_32FC1)};
  const Eigen::Vector3d centre = T_world_camera.translation();
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = T_world_camera.rotation() * camera.unproject({x, y}, 1.0);
      double nearest = std::numeric_limits<double>::max();
      for (const Slab& slab : slabs) {
        const double z = (slab.at - centre[slab.axis]) / ray[slab.axis];
        const Eigen::Vector3d point = centre + z * ray;
        bool is_inside = z > 0.05 && z < nearest;
        for (int a = 0; a < 3; ++a)
          is_inside &= a == slab.axis || (point[a] >= slab.low[a] && point[a] <= slab.high[a]);
        if (!is_inside) continue;
        nearest = z;
        picture.depth.at<float>(y, x) = static_cast<float>(z);
        picture.colour.at<cv::Vec3b>(y, x) = slab.colour;
      }
    }
  }
  return picture;
}

inline DenseOptions options() {
  DenseOptions result;
  result.voxel_size = 0.05;
  return result;
}

/// As a keyframe is fused; provenance: of all of it.
inline DenseView view(const Picture& picture, const Camera& camera, const DenseOptions& dense = options(),
                      Provenance provenance = Provenance::kMeasured) {
  const cv::Mat from(picture.colour.size(), CV_8UC1, cv::Scalar(static_cast<double>(provenance)));
  return ViewReducer(camera, dense, {}).reduce(picture.colour, picture.depth, from, {});
}

/// Poses along the x axis, a little turned.
inline std::vector<SE3> walk(int count) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i)
    poses.emplace_back(so3_exp({0.02 * i, 0.05 * (i - count / 2), 0.01 * i}),
                       Eigen::Vector3d(0.15 * i, 0.02 * i, 0.05 * i));
  return poses;
}

/// Distance of a point from the nearest of some slabs' planes.
inline double distance(const Eigen::Vector3f& point, const std::vector<Slab>& slabs) {
  double nearest = std::numeric_limits<double>::max();
  for (const Slab& slab : slabs)
    nearest = std::min(nearest, std::abs(static_cast<double>(point[slab.axis]) - slab.at));
  return nearest;
}

}  // namespace roslam::cloud_scene
