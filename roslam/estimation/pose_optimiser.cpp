// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/estimation/pose_optimiser.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "roslam/common/error.hpp"
#include "roslam/common/upper_median.hpp"

namespace roslam {

namespace {
constexpr double kMinDepth = 1e-3;  // metres; points nearer than that or behind the camera are not seen
// A step below both ends the iterations.
constexpr double kSmallTranslation = 1e-7;  // metres
constexpr double kSmallRotation = 1e-7;     // radians

using Measurements = std::vector<PoseMeasurement>;

struct NormalEquations {
  Matrix6d hessian = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  double weighted = 0.0;  // sum of squared errors, weighted
  double cost = 0.0;      // sum of squared errors, those beyond the chi-squared limit after Huber
};

double huber(double squared, double limit) {
  return squared <= limit ? squared : 2.0 * std::sqrt(limit * squared) - limit;
}

// Adds one measurement; T_camera_world is perturbed from the left.
void add(const ReprojectionError& term, const Eigen::Vector3d& point_camera, double weight,
         NormalEquations& system) {
  const double limit = chi_squared_limit(term.measurement);
  if (point_camera.z() <= kMinDepth) {
    // No pose is better for moving a point behind the camera: it costs what an outlier does.
    system.cost += weight * huber(outlier_limit(term.measurement), limit);
    return;
  }
  const Eigen::Vector3d error = term.error(point_camera);
  const Eigen::Matrix3d by_point = term.jacobian(point_camera);
  Eigen::Matrix<double, 3, 6> jacobian;
  jacobian.leftCols<3>() = by_point;
  jacobian.rightCols<3>() = -by_point * skew(point_camera);
  const double squared = error.squaredNorm();
  system.cost += weight * huber(squared, limit);
  if (squared > limit) weight *= std::sqrt(limit / squared);
  system.hessian.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose(), weight);
  system.gradient.noalias() += weight * jacobian.transpose() * error;
  system.weighted += weight * squared;
}

// The inverse of the information of the inliers, times the variance of unit weight.
Matrix6d covariance_of(const NormalEquations& system, double rows) {
  constexpr double kLeastScale = 0.05;  // of few measurements that happen to agree
  const double freedom = std::max(1.0, rows - 6.0);
  const Matrix6d information = system.hessian.selfadjointView<Eigen::Lower>();
  const Matrix6d inverse = information.ldlt().solve(Matrix6d::Identity());
  return std::max(kLeastScale, system.weighted / freedom) * 0.5 * (inverse + inverse.transpose());
}

// Robust standard deviation of the pixel errors, in units of the assumed one.
double scale_of_pixel_errors(const Camera& camera, const Measurements& measurements,
                             const SE3& T_camera_world) {
  constexpr double kSigmaOfMedian = 1.1774;  // median of a Rayleigh distribution, in sigmas
  std::vector<double> errors;
  errors.reserve(measurements.size());
  for (const PoseMeasurement& m : measurements) {
    if (m.weight < 1.0) continue;
    const Eigen::Vector3d point = T_camera_world * m.point_world;
    if (point.z() <= kMinDepth) continue;
    errors.push_back(m.measurement.pixel_weight * (camera.project(point) - m.measurement.pixel).norm());
  }
  return errors.empty() ? 0.0 : upper_median(errors) / kSigmaOfMedian;
}

NormalEquations linearise(const Camera& camera, const Measurements& measurements, const OptimisedPose& pose) {
  NormalEquations system;
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    if (!pose.is_inlier[i]) continue;
    const auto& [point_world, measurement, weight] = measurements[i];
    add({camera, measurement}, pose.T_camera_world * point_world, weight, system);
  }
  system.hessian.diagonal().array() += 1e-9;  // keeps a degenerate system solvable
  return system;
}

// Gauss-Newton on the inliers. A step that raises the cost is taken back and tried again with damping
// (Levenberg-Marquardt). False if the system cannot be solved.
bool minimise(const Camera& camera, const Measurements& measurements, int iterations, OptimisedPose& pose) {
  constexpr double kFirstDamping = 1e-3;
  constexpr double kRounding = 1e-9;  // share of the cost that rounding may raise it by
  NormalEquations system = linearise(camera, measurements, pose);
  double damping = 0.0;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    Matrix6d hessian = system.hessian;
    if (damping > 0.0) hessian.diagonal() *= 1.0 + damping;
    const Vector6d step = -hessian.selfadjointView<Eigen::Lower>().ldlt().solve(system.gradient);
    if (!step.allFinite()) return false;
    const SE3 before = pose.T_camera_world;
    pose.T_camera_world = SE3::exp(step) * before;
    if (step.head<3>().norm() < kSmallTranslation && step.tail<3>().norm() < kSmallRotation) break;
    const NormalEquations next = linearise(camera, measurements, pose);
    if (next.cost <= system.cost * (1.0 + kRounding)) {
      system = next;
      damping *= 0.1;
      if (damping < kFirstDamping) damping = 0.0;
    } else {
      pose.T_camera_world = before;
      damping = damping > 0.0 ? 10.0 * damping : kFirstDamping;
    }
  }
  return true;
}

void classify(const Camera& camera, const Measurements& measurements, OptimisedPose& pose) {
  pose.inliers = 0;
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    const Eigen::Vector3d point = pose.T_camera_world * measurements[i].point_world;
    const ReprojectionError term{camera, measurements[i].measurement};
    pose.is_inlier[i] = point.z() > kMinDepth &&
                        term.error(point).squaredNorm() <= outlier_limit(measurements[i].measurement);
    pose.inliers += pose.is_inlier[i] ? 1 : 0;
  }
}
}  // namespace

void PoseOptimiserOptions::validate() const {
  if (rounds < 1 || rounds > 100) throw OptionsError("pose.rounds must be 1 to 100");
  if (iterations < 1 || iterations > 100) throw OptionsError("pose.iterations must be 1 to 100");
}

OptimisedPose optimise_pose(const Camera& camera, const std::vector<PoseMeasurement>& measurements,
                            const SE3& initial_T_camera_world, const PoseOptimiserOptions& options) {
  OptimisedPose failed;
  failed.T_camera_world = initial_T_camera_world;
  failed.is_inlier.assign(measurements.size(), false);
  OptimisedPose result;
  result.T_camera_world = initial_T_camera_world;
  result.is_inlier.assign(measurements.size(), true);
  result.inliers = static_cast<int>(measurements.size());
  for (int round = 0; round < options.rounds && result.inliers >= 3; ++round) {
    if (!minimise(camera, measurements, options.iterations, result)) return failed;
    classify(camera, measurements, result);
  }
  if (result.inliers < 3 || !result.T_camera_world.is_finite()) return failed;
  result.pixel_error_scale = scale_of_pixel_errors(camera, measurements, result.T_camera_world);
  double rows = 0.0;
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    if (result.is_inlier[i])
      rows += measurements[i].weight * (measurements[i].measurement.has_depth() ? 3.0 : 2.0);
  }
  result.covariance = covariance_of(linearise(camera, measurements, result), rows);
  return result;
}

}  // namespace roslam
