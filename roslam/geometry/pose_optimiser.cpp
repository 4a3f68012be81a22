// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/pose_optimiser.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "roslam/error.hpp"

namespace roslam {

namespace {
constexpr double kMinDepth = 1e-3;  // metres; points nearer than that or behind the camera are not seen
constexpr double kConverged = 1e-7;

struct NormalEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
};

// Adds one measurement; T_camera_world is perturbed from the left.
void add(const ReprojectionError& term, const Eigen::Vector3d& point_camera, bool robust,
         NormalEquations& system) {
  const Eigen::Vector3d error = term.error(point_camera);
  const Eigen::Matrix3d by_point = term.jacobian(point_camera);
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian.leftCols<3>() = by_point;
  jacobian.rightCols<3>() = -by_point * skew(point_camera);
  const double squared = error.squaredNorm();
  const double limit = chi_squared_limit(term.measurement);
  const double weight = robust && squared > limit ? std::sqrt(limit / squared) : 1.0;
  system.hessian.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose(), weight);
  system.gradient.noalias() += weight * jacobian.transpose() * error;
}
}  // namespace

void PoseOptimiserOptions::validate() const {
  if (rounds < 1 || rounds > 100) throw OptionsError("pose.rounds must be 1 to 100");
  if (iterations < 1 || iterations > 100) throw OptionsError("pose.iterations must be 1 to 100");
}

OptimisedPose optimise_pose(const Camera& camera, const std::vector<PoseMeasurement>& measurements,
                            const SE3& initial_T_camera_world, const PoseOptimiserOptions& options) {
  OptimisedPose result{initial_T_camera_world, std::vector<bool>(measurements.size(), true),
                       static_cast<int>(measurements.size())};
  for (int round = 0; round < options.rounds && result.inliers >= 3; ++round) {
    const bool robust = round < options.rounds - 1;
    for (int iteration = 0; iteration < options.iterations; ++iteration) {
      NormalEquations system;
      for (std::size_t i = 0; i < measurements.size(); ++i) {
        if (!result.is_inlier[i]) continue;
        const Eigen::Vector3d point = result.T_camera_world * measurements[i].point_world;
        if (point.z() > kMinDepth) add({camera, measurements[i].measurement}, point, robust, system);
      }
      system.hessian.diagonal().array() += 1e-9;  // keeps a degenerate system solvable
      const Vector6d step = -system.hessian.selfadjointView<Eigen::Lower>().ldlt().solve(system.gradient);
      if (!step.allFinite())
        return {initial_T_camera_world, std::vector<bool>(measurements.size(), false), 0};
      result.T_camera_world = SE3::exp(step) * result.T_camera_world;
      if (step.norm() < kConverged) break;
    }
    result.inliers = 0;
    for (std::size_t i = 0; i < measurements.size(); ++i) {
      const Eigen::Vector3d point = result.T_camera_world * measurements[i].point_world;
      const ReprojectionError term{camera, measurements[i].measurement};
      result.is_inlier[i] = point.z() > kMinDepth &&
                            term.error(point).squaredNorm() <= outlier_limit(measurements[i].measurement);
      result.inliers += result.is_inlier[i] ? 1 : 0;
    }
  }
  if (result.inliers < 3 || !result.T_camera_world.is_finite()) {
    return {initial_T_camera_world, std::vector<bool>(measurements.size(), false), 0};
  }
  return result;
}

}  // namespace roslam
