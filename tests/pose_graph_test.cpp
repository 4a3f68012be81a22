// SPDX-License-Identifier: BSD-3-Clause
// Pose graphs with known solution.
#include "roslam/loop_closing/pose_graph.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "roslam/common/error.hpp"

namespace roslam {
namespace {

class PoseGraphTest : public testing::Test {
 protected:
  static constexpr std::size_t kNodes = 40;

  // Once around a circle of 20 m, looking ahead.
  static SE3 true_pose(std::size_t i) {
    const double angle = 2.0 * M_PI * static_cast<double>(i) / kNodes;
    const SE3 T_world_node(so3_exp({0.0, 0.0, angle}),
                           {20.0 * std::sin(angle), 20.0 - 20.0 * std::cos(angle), 0.3});
    return T_world_node.inverse();
  }

  Vector6d noise(double translation, double rotation) {
    std::normal_distribution<double> normal;
    Vector6d tangent;
    for (int k = 0; k < 6; ++k) tangent(k) = normal(random_) * (k < 3 ? translation : rotation);
    return tangent;
  }

  // Odometry with errors, the nodes where it puts them, and a loop edge from the last node to the first.
  PoseGraph drifted(double translation, double rotation) {
    PoseGraph graph;
    graph.nodes.push_back({true_pose(0), 1.0, true});
    for (std::size_t i = 1; i < kNodes; ++i) {
      const SE3 T_to_from =
          SE3::exp(noise(translation, rotation)) * true_pose(i) * true_pose(i - 1).inverse();
      graph.nodes.push_back({T_to_from * graph.nodes.back().T_node_world, 1.0, false});
      graph.edges.push_back({i - 1, i, T_to_from});
    }
    add_loop(graph, kNodes - 1, 0, true_pose(0) * true_pose(kNodes - 1).inverse());
    return graph;
  }

  static void add_loop(PoseGraph& graph, std::size_t from, std::size_t to, const SE3& T_to_from) {
    graph.edges.push_back({from, to, T_to_from, 1.0, 1.0, true});
  }

  static double error_of(const PoseGraph& graph, std::size_t i) {
    const SE3& T_node_world = graph.nodes[i].T_node_world;
    return (T_node_world.inverse().translation() - true_pose(i).inverse().translation()).norm();
  }

  std::mt19937_64 random_{3};
  const PoseGraphOptions options_;
};

TEST_F(PoseGraphTest, NoErrorAtTheTruth) {
  PoseGraph graph = drifted(0.0, 0.0);
  for (const auto& edge : graph.edges) EXPECT_LT(edge_error(graph, edge, options_).norm(), 1e-6);
  const auto summary = adjust_pose_graph(graph, options_);
  EXPECT_TRUE(summary.is_usable);
  for (std::size_t i = 0; i < kNodes; ++i) EXPECT_LT(error_of(graph, i), 1e-6);
}

TEST_F(PoseGraphTest, ErrorsAreInTheirSigmas) {
  PoseGraph graph;
  graph.nodes.resize(2);
  graph.nodes[1].T_node_world = SE3(so3_exp({0.0, 0.02, 0.0}), {0.1, 0.0, 0.0});
  graph.nodes[1].scale = std::exp(0.05);
  const auto error = edge_error(graph, {0, 1, SE3(), 1.0, 2.0}, options_);
  EXPECT_NEAR(error(0), 2.0 * 0.1 / options_.translation_sigma, 1e-9);
  EXPECT_NEAR(error(4), 2.0 * 0.02 / options_.rotation_sigma, 1e-9);
  EXPECT_NEAR(error(6), 2.0 * 0.05 / 0.01, 1e-9);  // the sigma of a relative scale is 1 %
  EXPECT_NEAR(error.norm(), std::hypot(error(0), error(4), error(6)), 1e-9);
}

TEST_F(PoseGraphTest, ALoopTakesTheDriftOut) {
  PoseGraph graph = drifted(0.02, 0.005);
  const double before = error_of(graph, kNodes - 1);
  ASSERT_GT(before, 0.5);
  EXPECT_TRUE(adjust_pose_graph(graph, options_).is_usable);
  EXPECT_LT(error_of(graph, kNodes - 1), 0.05);
  EXPECT_EQ(error_of(graph, 0), 0.0) << "the fixed node moved";
  for (std::size_t i = 0; i < kNodes; ++i) {
    EXPECT_EQ(graph.nodes[i].scale, 1.0);
    EXPECT_LT(error_of(graph, i), before);
  }
}

TEST_F(PoseGraphTest, AWrongLoopAmongRightOnesIsWeighedDown) {
  PoseGraph graph = drifted(0.005, 0.001);
  for (const std::size_t i : {5U, 12U, 20U})
    add_loop(graph, i + 15, i, true_pose(i) * true_pose(i + 15).inverse());
  PoseGraph misled = graph;
  add_loop(misled, 30, 10, SE3());  // these two lie forty metres apart
  adjust_pose_graph(graph, options_);
  adjust_pose_graph(misled, options_);
  for (std::size_t i = 0; i < kNodes; ++i) EXPECT_NEAR(error_of(misled, i), error_of(graph, i), 0.1) << i;
}

// Monocular scale drift; the loop edge determines it.
TEST_F(PoseGraphTest, ScaleThatDriftsIsFoundWhereItMay) {
  constexpr double kShrink = 0.99;
  PoseGraph graph;
  graph.nodes.push_back({true_pose(0), 1.0, true});
  double scale = 1.0;
  for (std::size_t i = 1; i < kNodes; ++i) {
    // What odometry measures: relative poses of the true path at the scale it has by then.
    const SE3 relative = true_pose(i) * true_pose(i - 1).inverse();
    scale *= kShrink;
    const SE3 T_to_from(relative.rotation(), scale * relative.translation());
    graph.nodes.push_back({T_to_from * graph.nodes.back().T_node_world, 1.0, false});
    graph.edges.push_back({i - 1, i, T_to_from});
  }
  const SE3 closing = true_pose(0) * true_pose(kNodes - 1).inverse();
  graph.edges.push_back({kNodes - 1, 0, closing, 1.0 / scale, 10.0, true});
  PoseGraphOptions options = options_;
  graph.adjusts_scale = true;
  EXPECT_TRUE(adjust_pose_graph(graph, options).is_usable);
  EXPECT_NEAR(graph.nodes.back().scale, scale, 0.02);
  // Camera centre of a similarity transform.
  const auto& last = graph.nodes.back();
  const Eigen::Vector3d centre =
      last.T_node_world.rotation().conjugate() * (-last.T_node_world.translation() / last.scale);
  EXPECT_LT((centre - true_pose(kNodes - 1).inverse().translation()).norm(), 1.0);
}

TEST_F(PoseGraphTest, RepeatsBitByBit) {
  PoseGraph once = drifted(0.02, 0.005);
  PoseGraph again = once;
  adjust_pose_graph(once, options_);
  adjust_pose_graph(again, options_);
  for (std::size_t i = 0; i < kNodes; ++i) {
    EXPECT_EQ(once.nodes[i].T_node_world.matrix(), again.nodes[i].T_node_world.matrix());
  }
}

TEST_F(PoseGraphTest, StopsWhenItIsTold) {
  PoseGraph graph = drifted(0.02, 0.005);
  const double before = error_of(graph, kNodes - 1);
  adjust_pose_graph(graph, options_, [] { return true; });
  EXPECT_NEAR(error_of(graph, kNodes - 1), before, 1e-9);
}

TEST_F(PoseGraphTest, LonelyNodesStay) {
  PoseGraph graph;
  graph.nodes.resize(3);
  graph.nodes[1].T_node_world = true_pose(7);
  EXPECT_TRUE(adjust_pose_graph(graph, options_).is_usable);
  EXPECT_EQ(graph.nodes[1].T_node_world.matrix(), true_pose(7).matrix());
}

TEST(PoseGraphOptions, NameTheFieldThatIsWrong) {
  PoseGraphOptions options;
  EXPECT_NO_THROW(options.validate());
  options.translation_sigma = 0.0;
  try {
    options.validate();
    FAIL();
  } catch (const OptionsError& error) {
    EXPECT_NE(std::string(error.what()).find("pose_graph.translation_sigma"), std::string::npos);
  }
}

}  // namespace
}  // namespace roslam
