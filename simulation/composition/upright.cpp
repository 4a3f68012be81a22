// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/composition/upright.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>

namespace roslam::simulation {
namespace {

constexpr int kStep = 8;              // pixels between normals
constexpr int kReach = 6;             // baseline of a normal, pixels
constexpr double kSmooth = 0.03;      // largest change of depth over that reach, as a share of the depth
constexpr double kLeastShare = 0.05;  // of the surfaces that must face up
constexpr std::size_t kLeastCount = 200;
// Cosines of 45 to 6 degrees: the cone of inlier normals narrows around their mean.
constexpr double kCones[] = {0.707, 0.82, 0.91, 0.966, 0.985, 0.9945, 0.9945, 0.9945};

}  // namespace

void UprightEstimate::add(const cv::Mat& depth, const SE3& T_world_camera) {
  const Eigen::Matrix3d R_world_camera = T_world_camera.rotation().toRotationMatrix();
  upper_ -= R_world_camera.col(1);
  const auto point = [&](int x, int y) {
    return camera_.unproject(camera_.undistort({static_cast<double>(x), static_cast<double>(y)}),
                             static_cast<double>(depth.at<float>(y, x)));
  };
  const auto is_smooth = [&](float z, float neighbour) {
    return neighbour > 0.0F && std::abs(neighbour - z) < static_cast<float>(kSmooth) * z;
  };
  for (int y = 0; y + kReach < depth.rows; y += kStep) {
    for (int x = 0; x + kReach < depth.cols; x += kStep) {
      const float z = depth.at<float>(y, x);
      if (z <= 0.0F || !is_smooth(z, depth.at<float>(y, x + kReach)) ||
          !is_smooth(z, depth.at<float>(y + kReach, x)))
        continue;
      const Eigen::Vector3d p = point(x, y);
      const Eigen::Vector3d normal = (point(x, y + kReach) - p).cross(point(x + kReach, y) - p).normalized();
      normals_.push_back(R_world_camera * (normal.dot(p) > 0.0 ? Eigen::Vector3d(-normal) : normal));
    }
  }
}

std::optional<Eigen::Vector3d> UprightEstimate::up() const {
  Eigen::Vector3d up = upper_.normalized();
  std::size_t count = 0;
  for (const double cone : kCones) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    count = 0;
    for (const auto& normal : normals_) {
      if (normal.dot(up) < cone) continue;
      sum += normal;
      ++count;
    }
    if (count < kLeastCount) return std::nullopt;
    up = sum.normalized();
  }
  if (static_cast<double>(count) < kLeastShare * static_cast<double>(normals_.size())) return std::nullopt;
  return up;
}

}  // namespace roslam::simulation
