// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "roslam/geometry/se3.hpp"

namespace roslam {

struct PoseGraphOptions {
  int iterations = 50;              ///< Levenberg-Marquardt steps at most
  double rotation_sigma = 0.005;    ///< radians that a relative pose may be off
  double translation_sigma = 0.02;  ///< metres that a relative pose may be off
  double scale_sigma = 0.01;        ///< logarithm of the scale that a relative pose may be off
  double loop_kernel = 10.0;        ///< sigmas from which on a loop that does not fit counts less and less
  bool adjusts_scale = false;       ///< true for one camera without depth, whose scale drifts

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Poses joined by relative poses, cut loose from the map: indices refer to the vectors in here.
struct PoseGraph {
  struct Node {
    SE3 T_node_world;  ///< a point is seen at scale * rotation * point + translation
    double scale = 1.0;
    bool is_fixed = false;
  };
  struct Edge {
    std::size_t from = 0;
    std::size_t to = 0;
    SE3 T_to_from;         ///< as measured, in the same sense
    double scale = 1.0;    ///< as measured
    double weight = 1.0;   ///< of the error, times 1 / sigma
    bool is_loop = false;  ///< may be wrong: counts less the worse it fits
  };
  std::vector<Node> nodes;
  std::vector<Edge> edges;
};

struct PoseGraphSummary {
  double initial_cost = 0.0;
  double final_cost = 0.0;
  bool is_usable = false;  ///< false if the solver failed; the graph is unchanged then
};

/// The error of an edge: translation, rotation vector and logarithm of the scale of what was measured against
/// what the nodes say, each in its sigma (Strasdat et al., RSS 2010).
Eigen::Matrix<double, 7, 1> edge_error(const PoseGraph& graph, const PoseGraph::Edge& edge,
                                       const PoseGraphOptions& options);

/// Moves the nodes so that the sum of the squared errors of all edges becomes least; loop edges are weighed
/// down by a robust kernel (Cauchy). One thread, so that results repeat bit by bit. should_stop is asked
/// after each step.
PoseGraphSummary adjust_pose_graph(PoseGraph& graph, const PoseGraphOptions& options,
                                   const std::function<bool()>& should_stop = {});

}  // namespace roslam
