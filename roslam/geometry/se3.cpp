// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/se3.hpp"

#include <cmath>

namespace roslam {

namespace {
constexpr double kSmallAngle = 1e-8;
}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Quaterniond so3_exp(const Eigen::Vector3d& omega) {
  const double theta = omega.norm();
  const double scale = theta < kSmallAngle ? 0.5 - theta * theta / 48.0 : std::sin(0.5 * theta) / theta;
  Eigen::Quaterniond q;
  q.w() = std::cos(0.5 * theta);
  q.vec() = scale * omega;
  return q.normalized();
}

Eigen::Vector3d so3_log(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = sign * q.vec();
  const double sine = v.norm();
  const double cosine = sign * q.w();
  const double scale = sine < kSmallAngle ? 2.0 / cosine : 2.0 * std::atan2(sine, cosine) / sine;
  return scale * v;
}

Eigen::Matrix3d so3_left_jacobian(const Eigen::Vector3d& omega) {
  const double theta = omega.norm();
  const Eigen::Matrix3d w = skew(omega);
  if (theta < 1e-5) {
    return Eigen::Matrix3d::Identity() + 0.5 * w + w * w / 6.0;
  }
  const double t2 = theta * theta;
  return Eigen::Matrix3d::Identity() + (1.0 - std::cos(theta)) / t2 * w +
         (theta - std::sin(theta)) / (t2 * theta) * w * w;
}
SE3 SE3::exp(const Vector6d& tangent) {
  const Eigen::Vector3d omega = tangent.tail<3>();
  return {so3_exp(omega), so3_left_jacobian(omega) * tangent.head<3>()};
}

Vector6d SE3::log() const {
  const Eigen::Vector3d omega = so3_log(rotation_);
  Vector6d tangent;
  tangent.head<3>() = so3_left_jacobian(omega).inverse() * translation_;
  tangent.tail<3>() = omega;
  return tangent;
}

SE3 SE3::inverse() const {
  const Eigen::Quaterniond inverse_rotation = rotation_.conjugate();
  return {inverse_rotation, -(inverse_rotation * translation_)};
}

SE3 SE3::operator*(const SE3& other) const {
  return {rotation_ * other.rotation_, rotation_ * other.translation_ + translation_};
}

Eigen::Matrix4d SE3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation_.toRotationMatrix();
  m.topRightCorner<3, 1>() = translation_;
  return m;
}

}  // namespace roslam
