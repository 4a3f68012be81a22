// SPDX-License-Identifier: BSD-3-Clause
// The poses of all frames of a session, which follow the map.
#include "roslam/slam/trajectory_log.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "roslam/common/error.hpp"

namespace roslam {
namespace {

using Frames = std::map<SubmapId, std::size_t>;

SE3 at(double x, double angle = 0.0) { return SE3(so3_exp({0.1, angle, -0.2}), {x, 0.5 * x, 3.0 - x}); }

double distance(const SE3& a, const SE3& b) {
  const SE3 difference = a.inverse() * b;
  return difference.translation().norm() + difference.angle();
}

// Of a correction of the map that moves everything.
const SE3 kCorrection(so3_exp({0.2, -0.5, 0.3}), {10.0, -20.0, 5.0});

class FrameLog : public testing::Test {
 protected:
  KeyframeId add_keyframe(const SE3& T_world_camera, SubmapId submap = SubmapId{0}) {
    return map_.add_keyframe(0, 0.0, T_world_camera.inverse(), std::make_shared<ObservedFrame>(), submap);
  }

  void move(KeyframeId id, const SE3& T_world_camera) {
    map_.find(id)->T_camera_world = T_world_camera.inverse();
  }

  // A frame every quarter of a second.
  void add(std::size_t index, const SE3& T_world_camera, KeyframeId reference,
           TrackingState state = TrackingState::kTracking) {
    TrackedFrame frame;
    frame.state = state;
    frame.timestamp = 0.25 * static_cast<double>(index);
    frame.T_camera_world = T_world_camera.inverse();
    frame.reference = reference;
    log_.add(frame, index, map_);
  }

  void add_without_pose(std::size_t index, TrackingState state) {
    TrackedFrame frame;
    frame.state = state;
    frame.timestamp = 0.25 * static_cast<double>(index);
    log_.add(frame, index, map_);
  }

  void expect_trajectory(SubmapId submap, const std::vector<StampedPose>& truth) const {
    const Trajectory poses = log_.trajectory(map_, submap);
    ASSERT_EQ(poses.size(), truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      EXPECT_EQ(poses[i].timestamp, truth[i].timestamp) << i;
      EXPECT_LT(distance(poses[i].T_world_camera, truth[i].T_world_camera), 1e-9) << i;
    }
  }

  Map map_{std::vector<float>{1.0F}};
  TrajectoryLog log_;
};

TEST_F(FrameLog, IsEmptyAtFirst) {
  EXPECT_EQ(log_.frames(), 0U);
  EXPECT_TRUE(log_.by_state().empty());
  EXPECT_TRUE(log_.rejected().empty());
  EXPECT_EQ(log_.clock_resets(), 0U);
  expect_trajectory(SubmapId{0}, {});
  EXPECT_EQ(log_.main_submap(map_), SubmapId{0});
  EXPECT_FALSE(log_.found_in_loaded_map(map_));
  EXPECT_TRUE(log_.frames_by_submap(map_).empty());
}

TEST_F(FrameLog, APoseMovesWithItsReferenceKeyframeAndNoOther) {
  const KeyframeId a = add_keyframe(at(0.0, 0.3));
  const KeyframeId b = add_keyframe(at(1.0, -0.1));
  add(0, at(0.0, 0.3), a);
  add(1, at(0.4, 0.2), a);
  add(2, at(0.8, 0.1), b);
  expect_trajectory(SubmapId{0}, {{0.0, at(0.0, 0.3)}, {0.25, at(0.4, 0.2)}, {0.5, at(0.8, 0.1)}});
  move(b, kCorrection * at(1.0, -0.1));
  expect_trajectory(SubmapId{0},
                    {{0.0, at(0.0, 0.3)}, {0.25, at(0.4, 0.2)}, {0.5, kCorrection * at(0.8, 0.1)}});
  move(a, kCorrection * at(0.0, 0.3));
  expect_trajectory(SubmapId{0}, {{0.0, kCorrection * at(0.0, 0.3)},
                                  {0.25, kCorrection * at(0.4, 0.2)},
                                  {0.5, kCorrection * at(0.8, 0.1)}});
}

TEST_F(FrameLog, APoseOutlivesItsReferenceKeyframe) {
  const KeyframeId a = add_keyframe(at(0.0, 0.3));
  const KeyframeId b = add_keyframe(at(1.0, -0.1));
  add(0, at(0.9, 0.1), b);
  map_.remove_keyframe(b, a);
  expect_trajectory(SubmapId{0}, {{0.0, at(0.9, 0.1)}});
  move(a, kCorrection * at(0.0, 0.3));
  expect_trajectory(SubmapId{0}, {{0.0, kCorrection * at(0.9, 0.1)}});
  EXPECT_EQ(log_.frames_by_submap(map_), (Frames{{SubmapId{0}, 1}}));
}

TEST_F(FrameLog, WithdrawnPosesLeaveTheTrajectory) {
  const KeyframeId a = add_keyframe(at(0.0));
  add(0, at(0.1), a);
  add(1, at(5.2), a);
  add_without_pose(2, TrackingState::kRecentlyLost);
  add(3, at(5.4), a, TrackingState::kPredicted);
  add(4, at(0.4), a);
  EXPECT_EQ(log_.withdraw_after(0.0), 2U);
  expect_trajectory(SubmapId{0}, {{0.0, at(0.1)}, {1.0, at(0.4)}});
  EXPECT_EQ(log_.withdrawn(), 2U);
  EXPECT_EQ(log_.by_state().at(TrackingState::kTracking), 2U);
  EXPECT_EQ(log_.by_state().at(TrackingState::kPredicted), 0U);
  EXPECT_EQ(log_.by_state().at(TrackingState::kRecentlyLost), 3U);
  EXPECT_EQ(log_.withdraw_after(-1.0), 1U);
  expect_trajectory(SubmapId{0}, {{1.0, at(0.4)}});
}

TEST_F(FrameLog, FramesWithoutAPoseAreCountedAndNotInTheTrajectory) {
  const KeyframeId a = add_keyframe(at(0.0));
  add_without_pose(0, TrackingState::kInitialising);
  add(1, at(0.1), a);
  add(2, at(0.2), a, TrackingState::kPredicted);
  add_without_pose(3, TrackingState::kRecentlyLost);
  add_without_pose(4, TrackingState::kRecentlyLost);
  add_without_pose(5, TrackingState::kLost);
  add(6, at(0.6), {});  // a pose in no map
  add(7, at(0.7), a);
  EXPECT_EQ(log_.frames(), 8U);
  EXPECT_EQ(log_.by_state(), (std::map<TrackingState, std::size_t>{{TrackingState::kInitialising, 1},
                                                                   {TrackingState::kTracking, 3},
                                                                   {TrackingState::kPredicted, 1},
                                                                   {TrackingState::kRecentlyLost, 2},
                                                                   {TrackingState::kLost, 1}}));
  expect_trajectory(SubmapId{0}, {{0.25, at(0.1)}, {0.5, at(0.2)}, {1.75, at(0.7)}});
  EXPECT_EQ(log_.frames_by_submap(map_), (Frames{{SubmapId{0}, 3}}));
}

TEST_F(FrameLog, PredictedPosesAreInterpolatedBetweenMeasuredOnes) {
  const KeyframeId a = add_keyframe(at(0.0));
  add(0, at(0.0), a);
  add(1, at(0.3), a, TrackingState::kPredicted);
  add(2, at(0.6), a, TrackingState::kPredicted);
  add(3, at(0.15), a);
  add(4, at(0.9), a, TrackingState::kPredicted);  // nothing was measured after it
  expect_trajectory(SubmapId{0},
                    {{0.0, at(0.0)}, {0.25, at(0.05)}, {0.5, at(0.1)}, {0.75, at(0.15)}, {1.0, at(0.9)}});
}

TEST_F(FrameLog, CountsRejectedFramesByReasonAndResetsOfTheClock) {
  log_.add_rejected(RejectReason::kMask);
  log_.add_rejected(RejectReason::kMask);
  log_.add_rejected(RejectReason::kTimeNotFinite);
  log_.add_clock_reset();
  log_.add_clock_reset();
  EXPECT_EQ(log_.rejected(), (std::map<RejectReason, std::size_t>{{RejectReason::kMask, 2},
                                                                  {RejectReason::kTimeNotFinite, 1}}));
  EXPECT_EQ(log_.clock_resets(), 2U);
  EXPECT_EQ(log_.frames(), 0U);
  EXPECT_TRUE(log_.by_state().empty());
}

TEST_F(FrameLog, EachSubmapHasATrajectoryUntilTheyAreMerged) {
  const KeyframeId a = add_keyframe(at(0.0), SubmapId{0});
  const KeyframeId b = add_keyframe(at(0.0), SubmapId{1});
  add(0, at(0.1), a);
  add(1, at(0.2), b);
  add(2, at(0.3), b);
  expect_trajectory(SubmapId{0}, {{0.0, at(0.1)}});
  expect_trajectory(SubmapId{1}, {{0.25, at(0.2)}, {0.5, at(0.3)}});
  expect_trajectory(SubmapId{2}, {});
  EXPECT_EQ(log_.frames_by_submap(map_), (Frames{{SubmapId{0}, 1}, {SubmapId{1}, 2}}));
  move(b, kCorrection * at(0.0));
  map_.merge_submaps(SubmapId{1}, SubmapId{0});
  expect_trajectory(SubmapId{0},
                    {{0.0, at(0.1)}, {0.25, kCorrection * at(0.2)}, {0.5, kCorrection * at(0.3)}});
  expect_trajectory(SubmapId{1}, {});
  EXPECT_EQ(log_.frames_by_submap(map_), (Frames{{SubmapId{0}, 3}}));
}

TEST_F(FrameLog, TheMainSubmapHasMostFrames) {
  const KeyframeId a = add_keyframe(at(0.0), SubmapId{0});
  const KeyframeId b = add_keyframe(at(0.0), SubmapId{1});
  const KeyframeId c = add_keyframe(at(0.0), SubmapId{2});
  add(0, at(0.1), a);
  EXPECT_EQ(log_.main_submap(map_), SubmapId{0});
  add(1, at(0.1), b);
  add(2, at(0.1), b);
  EXPECT_EQ(log_.main_submap(map_), SubmapId{1});
  for (std::size_t i = 3; i < 6; ++i) add(i, at(0.1), c);
  EXPECT_EQ(log_.main_submap(map_), SubmapId{2});
  EXPECT_FALSE(log_.found_in_loaded_map(map_));  // none was loaded
  map_.merge_submaps(SubmapId{1}, SubmapId{0});
  add(6, at(0.1), a);
  EXPECT_EQ(log_.main_submap(map_), SubmapId{0});
}

TEST_F(FrameLog, ASubmapWhoseLandmarksAreOnObjectsIsFound) {
  const KeyframeId on_person = add_keyframe(at(0.0), SubmapId{0});
  const KeyframeId on_wall = add_keyframe(at(1.0), SubmapId{1});
  const auto add_with = [&](std::size_t index, KeyframeId reference, int on_objects) {
    TrackedFrame frame;
    frame.state = TrackingState::kTracking;
    frame.T_camera_world = at(0.0).inverse();
    frame.reference = reference;
    log_.add(frame, index, map_);
    log_.add_evidence({100, on_objects});
  };
  for (std::size_t i = 0; i < 10; ++i) add_with(i, on_person, i < 3 ? 0 : 90);
  EXPECT_TRUE(log_.submaps_on_objects(map_).empty()) << "the only submap is the main one";
  for (std::size_t i = 10; i < 30; ++i) add_with(i, on_wall, 20);
  EXPECT_EQ(log_.submaps_on_objects(map_), std::set<SubmapId>{SubmapId{0}});
  map_.merge_submaps(SubmapId{0}, SubmapId{1});
  EXPECT_TRUE(log_.submaps_on_objects(map_).empty()) << "what was found static stays";
}

TEST_F(FrameLog, FramesWithoutAPoseDoNotMakeASubmapTheMainOne) {
  add_keyframe(at(0.0), SubmapId{0});
  const KeyframeId b = add_keyframe(at(0.0), SubmapId{1});
  for (std::size_t i = 0; i < 5; ++i) add_without_pose(i, TrackingState::kLost);
  EXPECT_EQ(log_.main_submap(map_), SubmapId{0});
  add(5, at(0.1), b);
  EXPECT_EQ(log_.main_submap(map_), SubmapId{1});
}

TEST_F(FrameLog, AFrameInTheLoadedMapMakesItsSubmapTheMainOne) {
  const KeyframeId loaded = add_keyframe(at(0.0), SubmapId{0});
  const KeyframeId also_loaded = add_keyframe(at(0.0), SubmapId{1});
  map_.begin_session();
  const KeyframeId own = add_keyframe(at(0.0), SubmapId{2});
  for (std::size_t i = 0; i < 5; ++i) add(i, at(0.1), own);
  EXPECT_EQ(log_.main_submap(map_), SubmapId{2});
  EXPECT_FALSE(log_.found_in_loaded_map(map_));
  add(5, at(0.1), also_loaded);
  EXPECT_EQ(log_.main_submap(map_), SubmapId{1});
  EXPECT_TRUE(log_.found_in_loaded_map(map_));
  add(6, at(0.1), loaded);
  add(7, at(0.1), loaded);
  EXPECT_EQ(log_.main_submap(map_), SubmapId{0});
  EXPECT_EQ(log_.frames_by_submap(map_), (Frames{{SubmapId{0}, 2}, {SubmapId{1}, 1}, {SubmapId{2}, 5}}));
}

TEST_F(FrameLog, AKeyframeOfThisSessionInALoadedSubmapIsOfTheLoadedMap) {
  add_keyframe(at(0.0), SubmapId{0});
  map_.begin_session();
  const KeyframeId joined = add_keyframe(at(1.0), SubmapId{0});
  const KeyframeId apart = add_keyframe(at(0.0), SubmapId{1});
  add(0, at(0.1), joined);
  add(1, at(0.1), apart);
  add(2, at(0.1), apart);
  EXPECT_TRUE(log_.found_in_loaded_map(map_));
  EXPECT_EQ(log_.main_submap(map_), SubmapId{0});
}

TEST_F(FrameLog, ASubmapThatIsMergedWithTheLoadedMapCountsAsLoaded) {
  add_keyframe(at(0.0), SubmapId{0});
  map_.begin_session();
  const KeyframeId own = add_keyframe(at(0.0), SubmapId{1});
  add(0, at(0.1), own);
  EXPECT_FALSE(log_.found_in_loaded_map(map_));
  EXPECT_EQ(log_.main_submap(map_), SubmapId{1});
  map_.merge_submaps(SubmapId{1}, SubmapId{0});
  EXPECT_TRUE(log_.found_in_loaded_map(map_));
  EXPECT_EQ(log_.main_submap(map_), SubmapId{0});
}

TEST_F(FrameLog, GivesThePoseOfAKeyframeInAnEarlierFrame) {
  const KeyframeId a = add_keyframe(at(0.0, 0.3));
  add(3, at(0.4, 0.2), a);
  add(5, at(0.6, 0.1), a);
  const KeyframeId b = add_keyframe(at(1.0, -0.1));
  const auto expect_pose = [&](std::size_t index, const SE3& T_world_frame, const SE3& T_world_keyframe) {
    const auto pose = log_.T_frame_keyframe(map_, index, b, 10.0);
    ASSERT_TRUE(pose) << index;
    EXPECT_LT(distance(*pose, T_world_frame.inverse() * T_world_keyframe), 1e-9) << index;
  };
  expect_pose(3, at(0.4, 0.2), at(1.0, -0.1));
  expect_pose(5, at(0.6, 0.1), at(1.0, -0.1));
  move(a, kCorrection * at(0.0, 0.3));  // the frames follow their keyframe
  expect_pose(3, kCorrection * at(0.4, 0.2), at(1.0, -0.1));
  move(b, kCorrection * at(1.0, -0.1));
  expect_pose(5, at(0.6, 0.1), at(1.0, -0.1));  // all moved alike
  for (const std::size_t unknown : {0U, 2U, 4U, 6U, 100U})
    EXPECT_FALSE(log_.T_frame_keyframe(map_, unknown, b, 10.0)) << unknown;
}

TEST_F(FrameLog, GivesNoPoseOfAFrameThatIsTooOld) {
  const KeyframeId a = add_keyframe(at(0.0));
  for (std::size_t i = 0; i <= 8; ++i) add(i, at(0.1), a);  // up to 2 s
  EXPECT_TRUE(log_.T_frame_keyframe(map_, 4, a, 1.0));      // 1 s old
  EXPECT_FALSE(log_.T_frame_keyframe(map_, 3, a, 1.0));
  EXPECT_TRUE(log_.T_frame_keyframe(map_, 3, a, 1.25));
  EXPECT_TRUE(log_.T_frame_keyframe(map_, 8, a, 0.0));
  EXPECT_FALSE(log_.T_frame_keyframe(map_, 7, a, 0.0));
  add_without_pose(9, TrackingState::kLost);  // frames without a pose count too
  EXPECT_FALSE(log_.T_frame_keyframe(map_, 4, a, 1.0));
}

TEST_F(FrameLog, GivesNoPoseOfAFrameThatHasNoneOrIsOfAnotherSubmap) {
  const KeyframeId a = add_keyframe(at(0.0), SubmapId{0});
  const KeyframeId b = add_keyframe(at(1.0), SubmapId{1});
  add(0, at(0.1), a);
  add_without_pose(1, TrackingState::kLost);
  add(2, at(0.3), b);
  EXPECT_TRUE(log_.T_frame_keyframe(map_, 0, a, 10.0));
  EXPECT_FALSE(log_.T_frame_keyframe(map_, 0, b, 10.0));
  EXPECT_FALSE(log_.T_frame_keyframe(map_, 1, a, 10.0));
  EXPECT_FALSE(log_.T_frame_keyframe(map_, 1, b, 10.0));
  EXPECT_TRUE(log_.T_frame_keyframe(map_, 2, b, 10.0));
  EXPECT_FALSE(log_.T_frame_keyframe(map_, 2, a, 10.0));
  map_.merge_submaps(SubmapId{1}, SubmapId{0});
  EXPECT_TRUE(log_.T_frame_keyframe(map_, 0, b, 10.0));
}

TEST_F(FrameLog, ThrowsForAReferenceThatIsNotInTheMap) {
  add_keyframe(at(0.0));
  EXPECT_NO_THROW(add(0, at(0.1), KeyframeId{0}));
  EXPECT_THROW(add(1, at(0.1), KeyframeId{1}), UsageError);
}

}  // namespace
}  // namespace roslam
