// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Geometry>

#include "roslam/estimation/measurement_model.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// The error of one measurement as a function of a pose and a point. The pose has six parameters: the
/// translation of T_camera_world, and a rotation vector omega relative to the initial rotation,
/// R = exp(omega) R_0, which stays small and thus away from singularities.
template <int kRows>  // 3 with depth, 2 without
class BundleCost : public ceres::SizedCostFunction<kRows, 6, 3> {
 public:
  BundleCost(const Camera& camera, const Measurement& measurement, const Eigen::Quaterniond& initial_rotation)
      : camera_(camera), measurement_(measurement), initial_rotation_(initial_rotation) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Map<const Eigen::Vector3d> translation(parameters[0]);
    const Eigen::Map<const Eigen::Vector3d> omega(parameters[0] + 3);
    const Eigen::Map<const Eigen::Vector3d> point(parameters[1]);
    const Eigen::Matrix3d rotation = (so3_exp(omega) * initial_rotation_).toRotationMatrix();
    const Eigen::Vector3d rotated = rotation * point;
    Eigen::Vector3d in_camera = rotated + translation;
    // A point behind the camera keeps a large but finite error.
    if (in_camera.z() < kMinDepth) in_camera.z() = kMinDepth;
    const ReprojectionError term{camera_, measurement_};
    Eigen::Map<Eigen::Matrix<double, kRows, 1>> error(residuals);
    error = term.error(in_camera).template head<kRows>();
    if (jacobians == nullptr) return true;
    const Eigen::Matrix<double, kRows, 3> by_camera_point =
        term.jacobian(in_camera).template topRows<kRows>();
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kRows, 6, Eigen::RowMajor>> by_pose(jacobians[0]);
      by_pose.template leftCols<3>() = by_camera_point;
      by_pose.template rightCols<3>().noalias() = -by_camera_point * skew(rotated) * so3_left_jacobian(omega);
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, kRows, 3, Eigen::RowMajor>> by_point(jacobians[1]);
      by_point.noalias() = by_camera_point * rotation;
    }
    return true;
  }

 private:
  static constexpr double kMinDepth = 1e-2;  // metres
  Camera camera_;
  Measurement measurement_;
  Eigen::Quaterniond initial_rotation_;
};

}  // namespace roslam
