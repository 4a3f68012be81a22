// SPDX-License-Identifier: BSD-3-Clause
// Corrections of maps that changed since the correction was worked out.
#include "roslam/loop_closing/map_correction.hpp"

#include <gtest/gtest.h>

#include "tests/keyframe_scene.hpp"

namespace roslam {

using namespace scene;

namespace {

// A correction worked out on a snapshot, while the local mapper went on with the map.
class CorrectionTest : public MapOfKeyframes {
 protected:
  void SetUp() override {
    k_ = add_keyframes(3);
    landmarks_ = add_landmarks(4, {k_[1], k_[2]});
    for (std::size_t i = 0; i < k_.size(); ++i) {
      correction_.T_old_new[k_[i]] = pose(0.2 * static_cast<double>(i), -0.3, 0.15 * static_cast<double>(i));
      snapshot_.push_back(map_.find(k_[i])->T_camera_world);
    }
    // Global bundle adjustment gave these positions for the first two.
    for (const std::size_t i : {0U, 1U}) {
      const Eigen::Vector3d before = map_.find(landmarks_[i])->position;
      correction_.positions.push_back(
          {landmarks_[i], before, motion(1) * before + Eigen::Vector3d(0, 0.04, 0)});
    }
  }

  // From coordinates before to those after the correction, around a keyframe.
  SE3 motion(std::size_t keyframe) const { return correction_.T_old_new.at(k_[keyframe]).inverse(); }

  std::vector<KeyframeId> k_;
  std::vector<LandmarkId> landmarks_;
  MapCorrection correction_;
  std::vector<SE3> snapshot_;
};

TEST_F(CorrectionTest, WithoutChangesSinceTheMapIsAsItWasWorkedOut) {
  const Eigen::Vector3d other = map_.find(landmarks_[2])->position;
  correction_.apply_to(map_);
  for (std::size_t i = 0; i < k_.size(); ++i)
    expect_same(map_.find(k_[i])->T_camera_world, snapshot_[i] * correction_.T_old_new.at(k_[i]));
  for (const auto& known : correction_.positions)
    EXPECT_LT((map_.find(known.landmark)->position - known.after).norm(), 1e-12);
  EXPECT_LT((map_.find(landmarks_[2])->position - motion(1) * other).norm(), 1e-12)
      << "with its oldest observer";
  EXPECT_EQ(map_.corrections(), 1U);
}

TEST_F(CorrectionTest, ALandmarkThatMovedSinceTheSnapshotKeepsThatMotion) {
  const Eigen::Vector3d moved(0.03, -0.02, 0.05);  // by local bundle adjustment
  map_.find(landmarks_[0])->position += moved;
  correction_.apply_to(map_);
  const auto& known = correction_.positions[0];
  const Eigen::Vector3d expected = known.after + motion(1).rotation() * moved;
  EXPECT_LT((map_.find(landmarks_[0])->position - expected).norm(), 1e-12);
  EXPECT_GT((map_.find(landmarks_[0])->position - known.after).norm(), 0.05);
  EXPECT_LT((map_.find(landmarks_[1])->position - correction_.positions[1].after).norm(), 1e-12)
      << "which did not move";
}

TEST_F(CorrectionTest, AKeyframeThatMovedSinceTheSnapshotKeepsThatMotion) {
  const SE3 moved = pose(0.03, -0.02, 0.01);  // by local bundle adjustment
  map_.find(k_[2])->T_camera_world = moved * snapshot_[2];
  correction_.apply_to(map_);
  expect_same(map_.find(k_[2])->T_camera_world, moved * snapshot_[2] * correction_.T_old_new.at(k_[2]));
  expect_same(map_.find(k_[1])->T_camera_world, snapshot_[1] * correction_.T_old_new.at(k_[1]));
}

// Where keyframe and landmark moved together, the measurement still fits after the correction.
TEST_F(CorrectionTest, MotionOfBothLeavesTheirMeasurementAsItWas) {
  correction_.positions.erase(correction_.positions.begin());
  correction_.positions.front().after = motion(1) * correction_.positions.front().before;
  const SE3 moved = pose(0.03, -0.02, 0.01);  // of the world around the keyframe
  Landmark& landmark = *map_.find(landmarks_[1]);
  landmark.position = moved * landmark.position;
  map_.find(k_[1])->T_camera_world = snapshot_[1] * moved.inverse();
  const Eigen::Vector3d in_camera = map_.find(k_[1])->T_camera_world * landmark.position;
  correction_.apply_to(map_);
  EXPECT_LT((map_.find(k_[1])->T_camera_world * landmark.position - in_camera).norm(), 1e-9);
}

TEST_F(CorrectionTest, KeyframesAddedSinceMoveWithTheMostCovisibleOfTheSnapshot) {
  const KeyframeId added = add_keyframe();
  add_landmarks(3, {k_[2], added});
  add_landmarks(5, {k_[1], added});
  const LandmarkId own = add_landmarks(1, {added}).front();
  const SE3 before = map_.find(added)->T_camera_world;
  const Eigen::Vector3d position = map_.find(own)->position;
  correction_.apply_to(map_);
  expect_same(map_.find(added)->T_camera_world, before * correction_.T_old_new.at(k_[1]));
  EXPECT_LT((map_.find(own)->position - motion(1) * position).norm(), 1e-9);
}

TEST_F(CorrectionTest, KeyframesAddedSinceThatShareNothingMoveWithTheLastOfTheirSubmap) {
  const KeyframeId added = add_keyframe();
  const KeyframeId elsewhere = add_keyframe(SubmapId{1});
  const SE3 before = map_.find(added)->T_camera_world;
  const SE3 elsewhere_before = map_.find(elsewhere)->T_camera_world;
  correction_.apply_to(map_);
  expect_same(map_.find(added)->T_camera_world, before * correction_.T_old_new.at(k_[2]));
  expect_same(map_.find(elsewhere)->T_camera_world, elsewhere_before);
}

TEST_F(CorrectionTest, WhatWasRemovedSinceStaysAway) {
  map_.remove_keyframe(k_[1], k_[2]);
  map_.remove_landmark(landmarks_[0]);
  const Eigen::Vector3d other = map_.find(landmarks_[2])->position;
  const SE3 T_1_2 = map_.T_camera_world(k_[1]) * map_.T_camera_world(k_[2]).inverse();
  correction_.apply_to(map_);
  EXPECT_EQ(map_.find(k_[1]), nullptr);
  EXPECT_EQ(map_.find(landmarks_[0]), nullptr);
  expect_same(relative(k_[1], k_[2]), T_1_2);
  EXPECT_LT((map_.find(landmarks_[2])->position - motion(2) * other).norm(), 1e-9) << "its oldest left";
}

}  // namespace
}  // namespace roslam
