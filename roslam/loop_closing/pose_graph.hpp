// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "roslam/geometry/se3.hpp"
#include "roslam/loop_closing/loop_closing_options.hpp"

namespace roslam {

/// A pose graph, independent of the map: indices refer to the vectors in here.
struct PoseGraph {
  struct Node {
    SE3 T_node_world;  ///< x_node = scale * R * x_world + t, with R and t of T_node_world
    double scale = 1.0;
    bool is_fixed = false;
  };
  struct Edge {
    std::size_t from = 0;
    std::size_t to = 0;
    SE3 T_to_from;         ///< measured relative pose
    double scale = 1.0;    ///< measured ratio, scale of "to" over that of "from"
    double weight = 1.0;   ///< factor of the error, beside 1 / sigma
    bool is_loop = false;  ///< may be wrong: the robust kernel applies
  };
  std::vector<Node> nodes;
  std::vector<Edge> edges;

  /// Estimates the scales as well (similarity transforms), as a monocular map would need, whose scale drifts.
  /// Maps with depth are corrected by rigid motions, so this is not an option.
  bool adjusts_scale = false;
};

struct PoseGraphSummary {
  double initial_cost = 0.0;
  double final_cost = 0.0;
  bool is_usable = false;  ///< false if the solver failed; the graph is unchanged then
};

/// The error of an edge: translation, rotation vector and log scale of the nodes' relative pose against the
/// measured one, in sigmas and times the edge's weight (similar to Strasdat et al., RSS 2010).
Eigen::Matrix<double, 7, 1> edge_error(const PoseGraph& graph, const PoseGraph::Edge& edge,
                                       const PoseGraphOptions& options);

/// Minimises the sum of the squared errors of all edges over the nodes (Levenberg-Marquardt), first without,
/// then with a robust (Cauchy) kernel on loop edges. One thread, for reproducible results. should_stop is
/// asked after each step.
PoseGraphSummary adjust_pose_graph(PoseGraph& graph, const PoseGraphOptions& options,
                                   const std::function<bool()>& should_stop = {});

}  // namespace roslam
