// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// Finds which way is up in the world from floors and tables: the direction that many surfaces face, near to
/// what the camera's pictures have up. A camera that looks down all the time shows only by them how far.
class UprightEstimate {
 public:
  explicit UprightEstimate(const Camera& camera) : camera_(camera) {}

  /// depth: CV_32FC1, metres, 0 = unknown.
  void add(const cv::Mat& depth, const SE3& T_world_camera);

  /// A unit vector in the world; nothing if too few surfaces face one direction.
  std::optional<Eigen::Vector3d> up() const;

 private:
  Camera camera_;
  std::vector<Eigen::Vector3d> normals_;             // of surfaces, in the world, towards the camera
  Eigen::Vector3d upper_ = Eigen::Vector3d::Zero();  // sum of what the pictures had up
};

}  // namespace roslam
