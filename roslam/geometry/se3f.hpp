// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "roslam/geometry/se3.hpp"

namespace roslam {

/// A rigid transform in single precision, enough for dense images and point clouds.
struct SE3f {
  Eigen::Matrix3f rotation;
  Eigen::Vector3f translation;

  explicit SE3f(const SE3& motion)
      : rotation(motion.rotation().toRotationMatrix().cast<float>()),
        translation(motion.translation().cast<float>()) {}
  Eigen::Vector3f operator*(const Eigen::Vector3f& point) const { return rotation * point + translation; }
};

}  // namespace roslam
