// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "roslam/common/export.hpp"

namespace roslam {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// The matrix [v]x with [v]x w = v x w.
ROSLAM_EXPORT Eigen::Matrix3d skew(const Eigen::Vector3d& v);

/// Rotation vector (radians) to unit quaternion, and back (angle in [0, pi]).
ROSLAM_EXPORT Eigen::Quaterniond so3_exp(const Eigen::Vector3d& omega);
ROSLAM_EXPORT Eigen::Vector3d so3_log(const Eigen::Quaterniond& q);

/// Left Jacobian J of SO(3): exp(omega + d) = exp(J d) exp(omega) to first order (Barfoot 2017, eq. 7.77).
ROSLAM_EXPORT Eigen::Matrix3d so3_left_jacobian(const Eigen::Vector3d& omega);

/// A rigid transform. A variable named T_a_b maps coordinates in frame b to coordinates in frame a.
class ROSLAM_EXPORT SE3 {
 public:
  SE3() : rotation_(Eigen::Quaterniond::Identity()), translation_(Eigen::Vector3d::Zero()) {}
  SE3(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation)
      : rotation_(rotation.normalized()), translation_(translation) {}
  SE3(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation)
      : SE3(Eigen::Quaterniond(rotation), translation) {}

  /// Restores a transform exactly from its parts, without normalising: the quaternion must be of unit length.
  static SE3 from_parts(const Eigen::Quaterniond& unit, const Eigen::Vector3d& translation) {
    SE3 result;
    result.rotation_ = unit;
    result.translation_ = translation;
    return result;
  }

  /// Exponential map and its inverse. Tangent: translation part first, then rotation vector (radians).
  static SE3 exp(const Vector6d& tangent);
  Vector6d log() const;

  SE3 inverse() const;
  SE3 operator*(const SE3& other) const;
  Eigen::Vector3d operator*(const Eigen::Vector3d& point) const { return rotation_ * point + translation_; }

  const Eigen::Quaterniond& rotation() const { return rotation_; }
  const Eigen::Vector3d& translation() const { return translation_; }
  Eigen::Matrix4d matrix() const;

  bool operator==(const SE3& other) const {
    return rotation_.coeffs() == other.rotation_.coeffs() && translation_ == other.translation_;
  }

  /// Rotation angle in radians, in [0, pi].
  double angle() const { return so3_log(rotation_).norm(); }
  bool is_finite() const { return rotation_.coeffs().allFinite() && translation_.allFinite(); }

 private:
  Eigen::Quaterniond rotation_;
  Eigen::Vector3d translation_;
};

}  // namespace roslam
