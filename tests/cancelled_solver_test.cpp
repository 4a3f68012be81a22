// SPDX-License-Identifier: BSD-3-Clause
// Cancelling of the solvers that take longest, from another thread. Meant for the thread sanitizer as well.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <random>
#include <thread>
#include <utility>

#include "roslam/loop_closing/pose_graph.hpp"
#include "roslam/mapping/bundle_adjustment.hpp"
#include "tests/loop_scene.hpp"

namespace roslam::scene {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

// Sets the flag that a solver asks for, from another thread, once the solver has tried so many steps.
class Canceller {
 public:
  explicit Canceller(int steps) : steps_(steps) {}
  ~Canceller() { note_step(); }

  std::function<bool()> should_stop() {
    return [this] {
      // It is asked first before any step.
      if (++asked_ == steps_ + 1) note_step();
      return is_cancelled_.load();
    };
  }

  int asked() const { return asked_; }

  // When the flag was set; not before the solver is done, if it never asked so often.
  Clock::time_point when() {
    note_step();
    thread_.join();
    return when_;
  }

 private:
  void note_step() {
    if (!std::exchange(is_noted_, true)) step_.set_value();
  }

  const int steps_;
  std::promise<void> step_;
  bool is_noted_ = false;
  int asked_ = 0;
  std::atomic<bool> is_cancelled_ = false;
  Clock::time_point when_;
  std::jthread thread_{[this] {
    step_.get_future().wait();
    when_ = Clock::now();
    is_cancelled_ = true;
  }};
};

// A flight along a wall, with errors of poses and points that take many steps to remove.
class CancelledBundle : public testing::Test {
 protected:
  CancelledBundle() {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    constexpr double kApart = 0.3;  // metres
    for (int i = 0; i < kPoses; ++i) {
      problem_.poses.push_back({WallFlight::on_wall(kApart * i), i == 0});
    }
    for (int p = 0; p < kPoints; ++p) {
      const double along = 0.5 * kPoses * kApart * (1.0 + uniform(random));
      problem_.points.emplace_back(along, 4.0 + uniform(random), 2.0 * uniform(random));
    }
    for (std::size_t i = 0; i < problem_.poses.size(); ++i) {
      for (std::size_t p = 0; p < problem_.points.size(); ++p) {
        const Eigen::Vector3d in_camera = problem_.poses[i].T_camera_world * problem_.points[p];
        const Eigen::Vector2d pixel =
            camera_.project(in_camera) + Eigen::Vector2d(normal(random), normal(random));
        if (pixel.x() < 0.0 || pixel.y() < 0.0 || pixel.x() > camera_.width || pixel.y() > camera_.height)
          continue;
        problem_.terms.push_back({i, p, Measurement::make(pixel.cast<float>(), 0.0F, 1.0F, {})});
      }
    }
    // The errors of odometry add up along the flight.
    SE3 drift;
    for (auto& pose : problem_.poses) {
      Vector6d off;
      for (int k = 0; k < 6; ++k) off(k) = (k < 3 ? 0.03 : 0.01) * normal(random);
      if (!pose.is_fixed) drift = drift * SE3::exp(off);
      pose.T_camera_world = pose.T_camera_world * drift;
    }
    for (auto& point : problem_.points)
      point += 0.4 * Eigen::Vector3d(normal(random), normal(random), normal(random));
  }

  static constexpr int kPoses = 250;
  static constexpr int kPoints = 3000;

  const Camera camera_;
  BundleProblem problem_;
  const BundleAdjustmentOptions options_{.iterations = 1000};
};

TEST_F(CancelledBundle, ReturnsSoonWithWhatItHas) {
  // The control: left alone, it goes on for many steps.
  BundleProblem whole = problem_;
  const BundleSummary uncancelled = adjust_bundle(camera_, whole, options_, [] { return false; });
  ASSERT_GT(uncancelled.iterations, 15);
  for (const int steps : {1, 8}) {
    SCOPED_TRACE(steps);
    BundleProblem problem = problem_;
    Canceller canceller(steps);
    const BundleSummary summary = adjust_bundle(camera_, problem, options_, canceller.should_stop());
    EXPECT_LT(seconds_since(canceller.when()), 1.0);
    EXPECT_TRUE(summary.is_usable);
    EXPECT_LT(summary.iterations, uncancelled.iterations);
    EXPECT_EQ(summary.initial_cost, uncancelled.initial_cost);
    EXPECT_LE(summary.final_cost, summary.initial_cost);
    EXPECT_GT(summary.final_cost, uncancelled.final_cost);
    if (steps > 1) {
      EXPECT_LT(summary.final_cost, 0.9 * summary.initial_cost) << "it made use of the steps";
    }
    // The problem was changed to what the summary tells.
    const BundleSummary again = adjust_bundle(camera_, problem, options_, [] { return true; });
    EXPECT_NEAR(again.initial_cost, summary.final_cost, 1e-6 * summary.final_cost);
  }
}

// Laps around a circle, with the drift of odometry and loops from lap to lap.
class CancelledPoseGraph : public testing::Test {
 protected:
  static constexpr std::size_t kNodes = 5000;
  static constexpr std::size_t kLap = 250;  // nodes

  static SE3 true_pose(std::size_t i) {
    return WallFlight::on_ring(2.0 * M_PI * static_cast<double>(i) / static_cast<double>(kLap));
  }

  CancelledPoseGraph() {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    graph_.nodes.push_back({true_pose(0), 1.0, true});
    for (std::size_t i = 1; i < kNodes; ++i) {
      Vector6d error;
      for (int k = 0; k < 6; ++k) error(k) = (k < 3 ? 0.01 : 0.002) * normal(random);
      const SE3 T_to_from = SE3::exp(error) * true_pose(i) * true_pose(i - 1).inverse();
      graph_.nodes.push_back({T_to_from * graph_.nodes.back().T_node_world, 1.0, false});
      graph_.edges.push_back({i - 1, i, T_to_from});
      if (i >= kLap && i % 10 == 0) graph_.edges.push_back({i - kLap, i, SE3(), 1.0, 1.0, true});
    }
  }

  double cost_of(const PoseGraph& graph) const {
    double sum = 0.0;
    for (const auto& edge : graph.edges) sum += 0.5 * edge_error(graph, edge, options_).squaredNorm();
    return sum;
  }

  const PoseGraphOptions options_{.iterations = 1000};
  PoseGraph graph_;
};

TEST_F(CancelledPoseGraph, ReturnsSoonWithWhatItHas) {
  PoseGraph graph = graph_;
  Canceller canceller(1);
  const PoseGraphSummary summary = adjust_pose_graph(graph, options_, canceller.should_stop());
  EXPECT_LT(seconds_since(canceller.when()), 1.0);
  EXPECT_TRUE(summary.is_usable);
  EXPECT_NEAR(summary.initial_cost, cost_of(graph_), 1e-6 * summary.initial_cost);
  EXPECT_LE(summary.final_cost, summary.initial_cost);
  EXPECT_LE(cost_of(graph), cost_of(graph_));
  for (const auto& node : graph.nodes) ASSERT_TRUE(node.T_node_world.is_finite());

  // The control: left alone, it goes on for many steps.
  PoseGraph whole = graph_;
  int steps = 0;
  const auto uncancelled = adjust_pose_graph(whole, options_, [&] { return ++steps < 0; });
  EXPECT_GT(steps, canceller.asked() + 3);
  EXPECT_LT(cost_of(whole), cost_of(graph));
  EXPECT_TRUE(uncancelled.is_usable);
}

}  // namespace
}  // namespace roslam::scene
