// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/mapping/bundle_adjustment.hpp"

#include <ceres/ceres.h>

#include <array>
#include <cmath>
#include <memory>

#include "roslam/common/error.hpp"
#include "roslam/mapping/bundle_cost.hpp"
#include "roslam/mapping/stop_callback.hpp"

namespace roslam {

namespace {
ceres::Solver::Options solver_options(const BundleAdjustmentOptions& options) {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_SCHUR;
  solver.max_num_iterations = options.iterations;
  solver.num_threads = 1;
  solver.function_tolerance = 1e-4;
  solver.logging_type = ceres::SILENT;
  return solver;
}

using PoseParameters = std::array<double, 6>;

void add_terms(const Camera& camera, BundleProblem& problem, std::vector<PoseParameters>& poses,
               ceres::LossFunction* huber2, ceres::LossFunction* huber3, ceres::Problem& ceres_problem) {
  for (const auto& term : problem.terms) {
    const Eigen::Quaterniond& rotation = problem.poses[term.pose].T_camera_world.rotation();
    ceres::CostFunction* cost = nullptr;
    if (term.measurement.has_depth()) {
      cost = new BundleCost<3>(camera, term.measurement, rotation);  // NOLINT: Ceres takes ownership
    } else {
      cost = new BundleCost<2>(camera, term.measurement, rotation);  // NOLINT: Ceres takes ownership
    }
    ceres_problem.AddResidualBlock(cost, term.measurement.has_depth() ? huber3 : huber2,
                                   poses[term.pose].data(), problem.points[term.point].data());
  }
}
}  // namespace

void BundleAdjustmentOptions::validate() const {
  if (iterations < 1 || iterations > 1000) throw OptionsError("bundle.iterations must be 1 to 1000");
  if (window < 1 || window > 1000) throw OptionsError("bundle.window must be 1 to 1000 keyframes");
  if (min_shared < 1) throw OptionsError("bundle.min_shared must be at least 1");
}

BundleSummary adjust_bundle(const Camera& camera, BundleProblem& problem,
                            const BundleAdjustmentOptions& options,
                            const std::function<bool()>& should_stop) {
  BundleProblem moved = problem;
  std::vector<PoseParameters> poses(moved.poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d& t = moved.poses[i].T_camera_world.translation();
    poses[i] = {t.x(), t.y(), t.z(), 0.0, 0.0, 0.0};
  }
  ceres::HuberLoss huber2(std::sqrt(kChiSquared2));
  ceres::HuberLoss huber3(std::sqrt(kChiSquared3));
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem ceres_problem(ownership);
  add_terms(camera, moved, poses, &huber2, &huber3, ceres_problem);

  ceres::Solver::Options solver = solver_options(options);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (auto& point : moved.points) {
    if (ceres_problem.HasParameterBlock(point.data())) ordering->AddElementToGroup(point.data(), 0);
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!ceres_problem.HasParameterBlock(poses[i].data())) continue;
    ordering->AddElementToGroup(poses[i].data(), 1);
    if (moved.poses[i].is_fixed) ceres_problem.SetParameterBlockConstant(poses[i].data());
  }
  solver.linear_solver_ordering = ordering;
  StopCallback callback(should_stop);
  if (should_stop) solver.callbacks.push_back(&callback);

  ceres::Solver::Summary summary;
  ceres::Solve(solver, &ceres_problem, &summary);
  if (!summary.IsSolutionUsable()) return {summary.initial_cost, summary.initial_cost, 0, false};
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (moved.poses[i].is_fixed) continue;
    const Eigen::Map<const Eigen::Vector3d> translation(poses[i].data());
    const Eigen::Map<const Eigen::Vector3d> omega(poses[i].data() + 3);
    moved.poses[i].T_camera_world =
        SE3(so3_exp(omega) * moved.poses[i].T_camera_world.rotation(), translation);
  }
  problem = std::move(moved);
  return {summary.initial_cost, summary.final_cost, static_cast<int>(summary.iterations.size()), true};
}

std::vector<bool> bundle_inliers(const Camera& camera, const BundleProblem& problem) {
  std::vector<bool> result;
  result.reserve(problem.terms.size());
  for (const auto& term : problem.terms) {
    const Eigen::Vector3d point = problem.poses[term.pose].T_camera_world * problem.points[term.point];
    const ReprojectionError error{camera, term.measurement};
    result.push_back(point.z() > 0.0 && error.error(point).squaredNorm() <= outlier_limit(term.measurement));
  }
  return result;
}

}  // namespace roslam
