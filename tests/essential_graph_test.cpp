// SPDX-License-Identifier: BSD-3-Clause
// The essential graph of maps of known covisibility.
#include "roslam/loop_closing/essential_graph.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/keyframe_scene.hpp"
#include "tests/loop_scene.hpp"

namespace roslam {

using namespace scene;

namespace {

class EssentialGraphTest : public MapOfKeyframes {
 protected:
  using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

  EssentialGraph graph_of(int min_shared, KeyframeId from, KeyframeId to) {
    auto result = EssentialGraph::of(map_, mutex_, min_shared, {from, to, relative(to, from)});
    EXPECT_TRUE(result);
    return *result;
  }

  // Keyframes of the edges that are no loops.
  static Pairs pairs(const EssentialGraph& essential) {
    Pairs result;
    for (const auto& edge : essential.graph.edges) {
      if (!edge.is_loop)
        result.emplace_back(essential.keyframes[edge.from].value, essential.keyframes[edge.to].value);
    }
    return result;
  }
};

TEST_F(EssentialGraphTest, SpansTheMapByTheMostCovisible) {
  const auto k = add_keyframes(6);
  add_landmarks(20, {k[0], k[1]});
  add_landmarks(30, {k[1], k[2]});
  add_landmarks(10, {k[0], k[2]});
  add_landmarks(5, {k[2], k[3]});
  add_landmarks(8, {k[0], k[3]});  // not the last one before it, but shares more
  // 4 shares nothing with an older one and follows the one before it.
  add_landmarks(50, {k[4], k[5]});
  const EssentialGraph essential = graph_of(100, k[0], k[5]);
  EXPECT_EQ(essential.keyframes, k);
  EXPECT_EQ(pairs(essential), (Pairs{{0, 1}, {1, 2}, {0, 3}, {3, 4}, {4, 5}}));
  ASSERT_EQ(essential.graph.nodes.size(), k.size());
  for (std::size_t i = 0; i < k.size(); ++i) {
    expect_same(essential.graph.nodes[i].T_node_world, map_.find(k[i])->T_camera_world);
    EXPECT_EQ(essential.graph.nodes[i].scale, 1.0);
    EXPECT_EQ(essential.graph.nodes[i].is_fixed, i == 0) << i;
  }
  EXPECT_FALSE(essential.graph.adjusts_scale);
}

TEST_F(EssentialGraphTest, AddsPairsThatShareMany) {
  const auto k = add_keyframes(4);
  add_landmarks(20, {k[0], k[1]});
  add_landmarks(30, {k[1], k[2]});
  add_landmarks(10, {k[0], k[2]});
  add_landmarks(9, {k[0], k[3]});
  add_landmarks(12, {k[2], k[3]});
  EXPECT_EQ(pairs(graph_of(10, k[0], k[3])), (Pairs{{0, 1}, {1, 2}, {0, 2}, {2, 3}}));
  EXPECT_EQ(pairs(graph_of(11, k[0], k[3])), (Pairs{{0, 1}, {1, 2}, {2, 3}}));
  EXPECT_EQ(pairs(graph_of(9, k[0], k[3])), (Pairs{{0, 1}, {1, 2}, {0, 2}, {2, 3}, {0, 3}}));
}

TEST_F(EssentialGraphTest, EdgesHoldTheRelativePosesOfTheMap) {
  const auto k = add_keyframes(25);
  for (std::size_t i = 1; i < k.size(); ++i) add_landmarks(10, {k[i - 1], k[i]});
  add_landmarks(10, {k[3], k[21]});
  const EssentialGraph essential = graph_of(10, k[0], k[24]);
  ASSERT_EQ(essential.graph.edges.size(), k.size() + 1);
  for (const auto& edge : essential.graph.edges) {
    EXPECT_EQ(edge.scale, 1.0);
    expect_same(edge.T_to_from, relative(essential.keyframes[edge.to], essential.keyframes[edge.from]));
    EXPECT_LT(edge_error(essential.graph, edge, {}).norm(), 1e-6);
  }
}

TEST_F(EssentialGraphTest, EdgesOfOneNodeTogetherCountAsOne) {
  const auto k = add_keyframes(30);
  for (std::size_t i = 1; i < k.size(); ++i) {
    for (std::size_t before = i > 3 ? i - 3 : 0; before < i; ++before) add_landmarks(10, {k[before], k[i]});
  }
  add_landmarks(10, {k[0], k[29]});  // further apart than drift is taken to grow over
  const EssentialGraph essential = graph_of(10, k[0], k[29]);
  std::vector<double> information(k.size(), 0.0);  // of a node against the older ones, per keyframe between
  std::vector<int> edges(k.size(), 0);
  for (const auto& edge : essential.graph.edges) {
    if (edge.is_loop) continue;
    ASSERT_LT(edge.from, edge.to);
    const double between = std::min(static_cast<double>(edge.to - edge.from), 20.0);
    information[edge.to] += edge.weight * edge.weight * between;
    ++edges[edge.to];
  }
  for (std::size_t i = 1; i < k.size(); ++i) {
    EXPECT_EQ(edges[i], i == 29 ? 4 : static_cast<int>(std::min<std::size_t>(i, 3)));
    EXPECT_NEAR(information[i], 1.0, 1e-9) << i;
  }
}

TEST_F(EssentialGraphTest, EdgesWeighLessTheFurtherTheyReach) {
  const auto k = add_keyframes(40);
  add_landmarks(10, {k[0], k[4]});
  add_landmarks(10, {k[0], k[39]});
  const EssentialGraph essential = graph_of(10, k[0], k[1]);
  const auto weight = [&](std::size_t from, std::size_t to) {
    for (const auto& edge : essential.graph.edges) {
      if (!edge.is_loop && edge.from == from && edge.to == to) return edge.weight;
    }
    return 0.0;
  };
  EXPECT_NEAR(weight(2, 3), 1.0, 1e-9);
  EXPECT_NEAR(weight(0, 4), 0.5, 1e-9);
  EXPECT_NEAR(weight(0, 39), 1.0 / std::sqrt(20.0), 1e-9);
}

TEST_F(EssentialGraphTest, EndsWithTheLoops) {
  const auto k = add_keyframes(8);
  const SE3 known = pose(0.2, 0.1, 0.3);
  const SE3 closing = pose(-0.1, 0.2, 0.1);
  map_.add_loop(k[1], k[5], known);
  map_.add_loop(k[2], k[6], known);
  map_.remove_keyframe(k[6], k[5]);
  const SE3 T_5_6 = map_.T_camera_world(k[5]) * map_.T_camera_world(k[6]).inverse();
  const auto essential = EssentialGraph::of(map_, mutex_, 100, {k[0], k[7], closing});
  ASSERT_TRUE(essential);
  const auto& edges = essential->graph.edges;
  ASSERT_EQ(edges.size(), 6U + 3U);
  const auto expect_loop = [&](const PoseGraph::Edge& edge, KeyframeId from, KeyframeId to,
                               const SE3& T_to_from) {
    EXPECT_TRUE(edge.is_loop);
    EXPECT_EQ(edge.weight, 1.0);
    EXPECT_EQ(essential->keyframes[edge.from], from);
    EXPECT_EQ(essential->keyframes[edge.to], to);
    expect_same(edge.T_to_from, T_to_from);
  };
  for (std::size_t e = 0; e < 6; ++e) EXPECT_FALSE(edges[e].is_loop);
  expect_loop(edges[6], k[1], k[5], known);
  expect_loop(edges[7], k[2], k[5], T_5_6 * known);  // that of the removed one, at its anchor
  expect_loop(edges[8], k[0], k[7], closing);
}

TEST_F(EssentialGraphTest, FixesTheFirstKeyframeOfEachSubmap) {
  std::vector<KeyframeId> k = add_keyframes(3);
  for (int i = 0; i < 2; ++i) k.push_back(add_keyframe(SubmapId{1}));
  k.push_back(add_keyframe());
  const EssentialGraph essential = graph_of(100, k[0], k[2]);
  for (std::size_t i = 0; i < k.size(); ++i)
    EXPECT_EQ(essential.graph.nodes[i].is_fixed, i == 0 || i == 3) << i;
  EXPECT_EQ(pairs(essential), (Pairs{{0, 1}, {1, 2}, {3, 4}, {2, 5}})) << "each submap by itself";
  map_.remove_keyframe(k[0], k[1]);
  const EssentialGraph without_first = graph_of(100, k[1], k[2]);
  EXPECT_EQ(without_first.keyframes.front(), k[1]);
  EXPECT_TRUE(without_first.graph.nodes.front().is_fixed);
}

TEST_F(EssentialGraphTest, IsNothingIfAKeyframeOfTheLoopIsGone) {
  const auto k = add_keyframes(4);
  EXPECT_TRUE(EssentialGraph::of(map_, mutex_, 100, {k[0], k[3], SE3()}));
  map_.remove_keyframe(k[3], k[2]);
  EXPECT_FALSE(EssentialGraph::of(map_, mutex_, 100, {k[0], k[3], SE3()}));
  EXPECT_FALSE(EssentialGraph::of(map_, mutex_, 100, {k[3], k[0], SE3()}));
  EXPECT_FALSE(EssentialGraph::of(map_, mutex_, 100, {k[0], KeyframeId{}, SE3()}));
  EXPECT_TRUE(EssentialGraph::of(map_, mutex_, 100, {k[0], k[2], SE3()}));
}

TEST_F(EssentialGraphTest, ItsCorrectionMovesKeyframesToTheNodes) {
  const auto k = add_keyframes(4);
  const auto landmarks = add_landmarks(5, {k[2], k[3]});
  EssentialGraph essential = graph_of(100, k[0], k[3]);
  const PoseGraph before = essential.graph;
  for (std::size_t i = 1; i < k.size(); ++i) {
    auto& node = essential.graph.nodes[i].T_node_world;
    node = pose(0.05 * static_cast<double>(i), 0.02, 0.03) * node;
  }
  const Eigen::Vector3d in_camera = map_.find(k[2])->T_camera_world * map_.find(landmarks[1])->position;
  const MapCorrection correction = essential.correction(before);
  EXPECT_EQ(correction.T_old_new.size(), k.size());
  EXPECT_TRUE(correction.positions.empty());
  correction.apply_to(map_);
  for (std::size_t i = 0; i < k.size(); ++i)
    expect_same(map_.find(k[i])->T_camera_world, essential.graph.nodes[i].T_node_world);
  expect_same(map_.find(k[0])->T_camera_world, before.nodes[0].T_node_world);
  // A landmark moves with the oldest keyframe that sees it.
  EXPECT_LT((map_.find(k[2])->T_camera_world * map_.find(landmarks[1])->position - in_camera).norm(), 1e-9);
}

// Once around a circular wall with drift, and the loop that closes the ring.
class DriftedRing : public testing::Test {
 protected:
  static constexpr double kStep = 0.05;  // radians between keyframes

  void SetUp() override {
    flight_.build_ring();
    for (double angle = 0.0; angle < 2.0 * M_PI; angle += kStep) fly_to(angle);
    last_ = KeyframeId{static_cast<std::uint32_t>(flight_.flown() - 1)};
  }

  KeyframeId fly_to(double angle) { return flight_.fly_to(scene::WallFlight::on_ring(angle), 0.004, map_); }

  EssentialGraph closed_by(const SE3& T_last_first) {
    return *EssentialGraph::of(map_, mutex_, 100, {KeyframeId{0}, last_, T_last_first});
  }

  SE3 relative(KeyframeId to, KeyframeId from) const {
    return map_.T_camera_world(to) * map_.T_camera_world(from).inverse();
  }

  SE3 true_T_last_first() const {
    return scene::WallFlight::on_ring(last_.value * kStep) * scene::WallFlight::on_ring(0.0).inverse();
  }

  scene::WallFlight flight_{7};
  Map map_{{1.0F, 1.2F, 1.44F, 1.728F}};
  MapMutex mutex_;
  KeyframeId last_;
};

TEST_F(DriftedRing, CloseByItsLoop) {
  const double drifted = flight_.error_of(map_, last_);
  const double mean = flight_.mean_error(map_);
  ASSERT_GT(drifted, 0.3);
  EssentialGraph essential = closed_by(true_T_last_first());
  const PoseGraph before = essential.graph;
  ASSERT_TRUE(adjust_pose_graph(essential.graph, {}).is_usable);
  essential.correction(before).apply_to(map_);
  EXPECT_LT(flight_.error_of(map_, last_), 0.1 * drifted);
  EXPECT_LT(flight_.mean_error(map_), 0.4 * mean);
  EXPECT_EQ(flight_.error_of(map_, KeyframeId{0}), 0.0) << "the first keyframe is fixed";
}

// The loop that the drifted map implies already.
TEST_F(DriftedRing, StaysAsItIsByALoopThatAgreesWithIt) {
  const double drifted = flight_.error_of(map_, last_);
  EssentialGraph essential = closed_by(relative(last_, KeyframeId{0}));
  const PoseGraph before = essential.graph;
  ASSERT_TRUE(adjust_pose_graph(essential.graph, {}).is_usable);
  essential.correction(before).apply_to(map_);
  EXPECT_NEAR(flight_.error_of(map_, last_), drifted, 1e-6);
}

TEST_F(DriftedRing, WhatWasAddedAfterTheSnapshotMovesAlong) {
  EssentialGraph essential = closed_by(true_T_last_first());
  const PoseGraph before = essential.graph;
  ASSERT_TRUE(adjust_pose_graph(essential.graph, {}).is_usable);
  // Three more keyframes while the graph was adjusted.
  std::vector<KeyframeId> added;
  for (int i = 1; i <= 3; ++i) added.push_back(fly_to((last_.value + static_cast<unsigned>(i)) * kStep));
  std::vector<SE3> from_last;
  std::vector<double> drifted;
  for (const KeyframeId id : added) {
    from_last.push_back(relative(id, last_));
    drifted.push_back(flight_.error_of(map_, id));
  }
  LandmarkId new_landmark;
  for (const LandmarkId id : map_.find(added[1])->landmarks) {
    if (id.is_valid() && map_.find(id)->observations.front().keyframe == added[0]) new_landmark = id;
  }
  ASSERT_TRUE(new_landmark.is_valid()) << "created after the snapshot";
  const auto in_camera = [&] { return map_.T_camera_world(added[0]) * map_.find(new_landmark)->position; };
  const Eigen::Vector3d seen_before = in_camera();

  essential.correction(before).apply_to(map_);
  for (std::size_t i = 0; i < added.size(); ++i) {
    EXPECT_LT(flight_.error_of(map_, added[i]), 0.2 * drifted[i]);
    // They move with the keyframe of the snapshot that shares most landmarks, which is one of the last.
    const SE3 difference = relative(added[i], last_) * from_last[i].inverse();
    EXPECT_LT(difference.translation().norm(), 0.02) << i;
    EXPECT_LT(difference.angle(), 0.005) << i;
  }
  EXPECT_LT((in_camera() - seen_before).norm(), 1e-9);
}

}  // namespace
}  // namespace roslam
