// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/dense/dense_mapper.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "tests/dynamic_scene.hpp"

/// A room of flat slabs for dense mapping, rendered for the small camera of dynamic_scene.hpp.
namespace roslam::dense_scene {

/// A rectangle perpendicular to an axis of the world frame, metres.
struct Slab {
  int axis = 2;     ///< its normal
  double at = 4.0;  ///< metres along that axis
  Eigen::Vector3d low{-9, -9, -9}, high{9, 9, 9};
  cv::Vec3b colour{40, 80, 120};
};

inline const Slab kWall{2, 4.0, {-9, -9, -9}, {9, 9, 9}, {40, 80, 160}};
inline const Slab kFloor{1, 1.2, {-9, -9, -9}, {9, 9, 9}, {120, 120, 60}};

struct Image {
  cv::Mat colour, depth;
};

/// Renders the slabs for a camera without distortion.
inline Image show(const std::vector<Slab>& slabs, const SE3& T_world_camera, const Camera& camera) {
  Image image{cv::Mat::zeros(camera.height, camera.width, CV_8UC3),
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
        image.depth.at<float>(y, x) = static_cast<float>(z);
        image.colour.at<cv::Vec3b>(y, x) = slab.colour;
      }
    }
  }
  return image;
}

inline DenseOptions options() {
  DenseOptions result;
  result.voxel_size = 0.05;
  return result;
}

/// The image as a keyframe for fusion; provenance: of all its pixels.
inline DepthKeyframe view(const Image& image, const Camera& camera, const DenseOptions& dense = options(),
                          Provenance provenance = Provenance::kMeasured) {
  const cv::Mat from(image.colour.size(), CV_8UC1, cv::Scalar(static_cast<double>(provenance)));
  return DepthKeyframeReducer(camera, dense, {}).reduce(image.colour, image.depth, from, {});
}

/// Poses T_world_camera along the x axis, slightly rotated.
inline std::vector<SE3> walk(int count) {
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i)
    poses.emplace_back(so3_exp({0.02 * i, 0.05 * (i - count / 2), 0.01 * i}),
                       Eigen::Vector3d(0.15 * i, 0.02 * i, 0.05 * i));
  return poses;
}

/// Distance of a point from the nearest of the slabs' planes, metres.
inline double distance(const Eigen::Vector3f& point, const std::vector<Slab>& slabs) {
  double nearest = std::numeric_limits<double>::max();
  for (const Slab& slab : slabs)
    nearest = std::min(nearest, std::abs(static_cast<double>(point[slab.axis]) - slab.at));
  return nearest;
}

}  // namespace roslam::dense_scene
