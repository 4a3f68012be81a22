// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam::simulation {

/// Estimates the up direction of the world from floors and tables: the dominant surface normal near the mean
/// up direction of the images, which by itself is biased by the pitch of a camera that always looks down.
class UprightEstimate {
 public:
  explicit UprightEstimate(const Camera& camera) : camera_(camera) {}

  /// depth: CV_32FC1, metres, 0 = unknown.
  void add(const cv::Mat& depth, const SE3& T_world_camera);

  /// A unit vector, world frame; nullopt if too few normals agree on one direction.
  std::optional<Eigen::Vector3d> up() const;

 private:
  Camera camera_;
  std::vector<Eigen::Vector3d> normals_;             // of surfaces, world frame, towards the camera
  Eigen::Vector3d upper_ = Eigen::Vector3d::Zero();  // sum of the up directions of the images
};

}  // namespace roslam::simulation
