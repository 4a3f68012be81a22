// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop_closing/pose_graph.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>
#include <cmath>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/mapping/stop_callback.hpp"

namespace roslam {

namespace {
constexpr int kPose = 6;  // translation, and a rotation vector applied to the initial rotation
constexpr int kErrors = 7;
constexpr double kScaleSigma = 0.01;  // of the logarithm of a relative scale

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <typename T>
using Quaternion = Eigen::Quaternion<T>;

template <typename T>
Quaternion<T> rotated(const T* omega, const Eigen::Quaterniond& rotation) {
  T q[4];
  ceres::AngleAxisToQuaternion(omega, q);
  return Quaternion<T>(q[0], q[1], q[2], q[3]) * rotation.cast<T>();
}

struct EdgeCost {
  Eigen::Quaterniond from_rotation;
  Eigen::Quaterniond to_rotation;
  SE3 T_to_from;
  double log_scale;
  Eigen::Matrix<double, kErrors, 1> weights;

  template <typename T>
  bool operator()(const T* from, const T* log_scale_from, const T* to, const T* log_scale_to,
                  T* errors) const {
    const Eigen::Map<const Vector3<T>> t_from(from);
    const Eigen::Map<const Vector3<T>> t_to(to);
    const Quaternion<T> R = rotated(to + 3, to_rotation) * rotated(from + 3, from_rotation).conjugate();
    const T log_ratio = *log_scale_to - *log_scale_from;
    const Quaternion<T> difference = R * T_to_from.rotation().conjugate().cast<T>();
    const T q[4] = {difference.w(), difference.x(), difference.y(), difference.z()};
    Eigen::Map<Eigen::Matrix<T, kErrors, 1>> error(errors);
    error.template head<3>() = t_to - exp(log_ratio) * (R * t_from) - T_to_from.translation().cast<T>();
    ceres::QuaternionToAngleAxis(q, errors + 3);
    error(6) = log_ratio - log_scale;
    error.array() *= weights.cast<T>().array();
    return true;
  }
};

EdgeCost cost_of(const PoseGraph& graph, const PoseGraph::Edge& edge, const PoseGraphOptions& options) {
  EdgeCost cost{graph.nodes[edge.from].T_node_world.rotation(),
                graph.nodes[edge.to].T_node_world.rotation(),
                edge.T_to_from,
                std::log(edge.scale),
                {}};
  cost.weights.head<3>().setConstant(edge.weight / options.translation_sigma);
  cost.weights.segment<3>(3).setConstant(edge.weight / options.rotation_sigma);
  cost.weights(6) = edge.weight / kScaleSigma;
  return cost;
}

struct Parameters {
  std::array<double, kPose> pose;
  double log_scale;
};

Parameters parameters_of(const PoseGraph::Node& node) {
  const Eigen::Vector3d& t = node.T_node_world.translation();
  return {{t.x(), t.y(), t.z(), 0.0, 0.0, 0.0}, std::log(node.scale)};
}

void set_node(const Parameters& parameters, PoseGraph::Node& node) {
  const Eigen::Map<const Eigen::Vector3d> translation(parameters.pose.data());
  const Eigen::Map<const Eigen::Vector3d> omega(parameters.pose.data() + 3);
  node.T_node_world = SE3(so3_exp(omega) * node.T_node_world.rotation(), translation);
  node.scale = std::exp(parameters.log_scale);
}
}  // namespace

void PoseGraphOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("pose_graph.") + message);
  };
  require(iterations >= 1 && iterations <= 1000, "iterations must be 1 to 1000");
  require(rotation_sigma > 0.0, "rotation_sigma must be positive (radians)");
  require(translation_sigma > 0.0, "translation_sigma must be positive (metres)");
  require(loop_kernel > 0.0, "loop_kernel must be positive (sigmas)");
}

Eigen::Matrix<double, 7, 1> edge_error(const PoseGraph& graph, const PoseGraph::Edge& edge,
                                       const PoseGraphOptions& options) {
  const Parameters from = parameters_of(graph.nodes[edge.from]);
  const Parameters to = parameters_of(graph.nodes[edge.to]);
  Eigen::Matrix<double, kErrors, 1> error;
  cost_of(graph, edge, options)(from.pose.data(), &from.log_scale, to.pose.data(), &to.log_scale,
                                error.data());
  return error;
}

namespace {
// Solves the graph once; loss: kernel of loop edges, null: plain squares.
ceres::Solver::Summary solve(const PoseGraph& graph, const PoseGraphOptions& options,
                             ceres::LossFunction* loss, const std::function<bool()>& should_stop,
                             std::vector<Parameters>& nodes) {
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(ownership);
  using Cost = ceres::AutoDiffCostFunction<EdgeCost, kErrors, kPose, 1, kPose, 1>;
  for (const auto& edge : graph.edges) {
    Parameters& from = nodes[edge.from];
    Parameters& to = nodes[edge.to];
    problem.AddResidualBlock(
        new Cost(new EdgeCost(cost_of(graph, edge, options))),  // NOLINT: Ceres owns both
        edge.is_loop ? loss : nullptr, from.pose.data(), &from.log_scale, to.pose.data(), &to.log_scale);
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!problem.HasParameterBlock(nodes[i].pose.data())) continue;
    if (graph.nodes[i].is_fixed) problem.SetParameterBlockConstant(nodes[i].pose.data());
    if (graph.nodes[i].is_fixed || !graph.adjusts_scale)
      problem.SetParameterBlockConstant(&nodes[i].log_scale);
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  solver.max_num_iterations = options.iterations;
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  StopCallback callback(should_stop);
  if (should_stop) solver.callbacks.push_back(&callback);
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &problem, &summary);
  return summary;
}
}  // namespace

PoseGraphSummary adjust_pose_graph(PoseGraph& graph, const PoseGraphOptions& options,
                                   const std::function<bool()>& should_stop) {
  std::vector<Parameters> nodes;
  for (const auto& node : graph.nodes) nodes.push_back(parameters_of(node));
  // Before drift is distributed, a right loop has as large an error as a wrong one: no kernel at first.
  const auto first = solve(graph, options, nullptr, should_stop, nodes);
  ceres::CauchyLoss robust(options.loop_kernel);
  const auto last = solve(graph, options, &robust, should_stop, nodes);
  if (!first.IsSolutionUsable() || !last.IsSolutionUsable())
    return {first.initial_cost, first.initial_cost, false};
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!graph.nodes[i].is_fixed) set_node(nodes[i], graph.nodes[i]);
  }
  return {first.initial_cost, last.final_cost, true};
}

}  // namespace roslam
