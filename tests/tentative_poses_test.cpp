// SPDX-License-Identifier: BSD-3-Clause
// Poses that few landmarks support are withdrawn when the next image contradicts them: on exact projections
// of points, a part of which is there twice, as windows of a house or tiles of a corridor are.
#include "roslam/tracking/tentative_poses.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/map/keyframe_pose_table.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/mapping/local_mapper.hpp"
#include "roslam/tracking/tracker.hpp"

namespace roslam {
namespace {

using Eigen::Vector3d;

struct WorldPoint {
  Vector3d position;
  Descriptor descriptor;
};

class RepeatedStructure : public testing::Test {
 protected:
  // Points of a wall, and 30 that are there once more to the right by `period` (metres).
  void build(double period, int fresh = 25) {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> x(-1.2, 1.2), y(-0.9, 0.9), z(2.3, 2.7);
    const auto point = [&] {
      return WorldPoint{{x(random), y(random), z(random)}, {random(), random(), random(), random()}};
    };
    for (int i = 0; i < 250; ++i) unique_.push_back(point());
    while (repeated_.size() < 30) {
      WorldPoint here = point();
      if (std::abs(here.position.x()) > 0.7) continue;
      repeated_.push_back(here);
      here.position.x() += period;
      copies_.push_back(here);
    }
    for (int i = 0; i < fresh; ++i) fresh_.push_back(point());
    tracker_ = std::make_unique<Tracker>(camera_, map_, Tracker::Settings{});
    mapper_ = std::make_unique<LocalMapper>(camera_, map_, mutex_, LocalMapper::Settings{});
  }

  // Looking along z from that x.
  static SE3 at(double x) { return {Eigen::Quaterniond::Identity(), Vector3d(-x, 0.0, 0.0)}; }

  std::shared_ptr<const ObservedFrame> view(const SE3& T_camera_world,
                                            const std::vector<std::vector<WorldPoint>>& groups) const {
    auto result = std::make_shared<ObservedFrame>();
    for (const auto& group : groups) {
      for (const WorldPoint& point : group) {
        const Vector3d in_camera = T_camera_world * point.position;
        const Eigen::Vector2d pixel = camera_.project(in_camera);
        if (pixel.x() < 0 || pixel.y() < 0 || pixel.x() > 639 || pixel.y() > 479) continue;
        result->pixels.push_back(pixel.cast<float>());
        result->depths.push_back(static_cast<float>(in_camera.z()));
        result->descriptors.push_back(point.descriptor);
      }
    }
    result->levels.resize(result->pixels.size(), 0);
    result->angles.resize(result->pixels.size(), 0.0F);
    result->colours.assign(result->pixels.size(), cv::Vec3b(0, 0, 0));
    result->grid = FeatureGrid(result->pixels, {0.0, 0.0, 640.0, 480.0});
    return result;
  }

  std::shared_ptr<const ObservedFrame> whole(double x) const {
    return view(at(x), {unique_, repeated_, copies_});
  }

  TrackedFrame track(std::shared_ptr<const ObservedFrame> seen, const FrameHint& hint = {}) {
    time_ += 0.1;
    return tracker_->track(std::move(seen), time_, hint);
  }

  KeyframeId make_keyframe(TrackedFrame& frame) {
    const KeyframeId id = mapper_->insert(frame, 0);
    tracker_->keyframe_created(id);
    frame.reference = id;
    return id;
  }

  // T_camera_world that the map has for a camera at x: the map begins at the first camera.
  SE3 in_map(double x) const { return at(x) * *T_world_map_; }

  // Starts the map and tracks a camera that moves slowly. Returns its x after that.
  double fly() {
    TrackedFrame first = track(whole(0.0));
    EXPECT_EQ(first.state, TrackingState::kTracking);
    T_world_map_ = *first.T_camera_world;
    make_keyframe(first);
    double x = 0.0;
    for (int i = 0; i < 4; ++i) {
      x += 0.01;
      const TrackedFrame frame = track(whole(x));
      EXPECT_EQ(frame.state, TrackingState::kTracking);
      EXPECT_LT(error(frame, x), 0.001);
    }
    return x;
  }

  double error(const TrackedFrame& frame, double x) const {
    return (*frame.T_camera_world * in_map(x).inverse()).translation().norm();
  }

  // An image in which the map knows the points that exist twice alone, with a prediction by flow that is off
  // by the period.
  TrackedFrame mislead(double x, double period, const std::vector<WorldPoint>& besides = {}) {
    FrameHint hint;
    hint.T_camera_world = in_map(x + period);
    return track(view(at(x), {repeated_, besides}), hint);
  }

  Camera camera_;
  std::vector<WorldPoint> unique_, repeated_, copies_;
  std::vector<WorldPoint> fresh_;  // not in view when the map begins
  Map map_{{1.0F, 1.2F, 1.44F}};
  MapMutex mutex_;
  std::unique_ptr<Tracker> tracker_;
  std::unique_ptr<LocalMapper> mapper_;
  std::optional<SE3> T_world_map_;
  double time_ = 0.0;
};

// The step back is faster than a drone can be.
TEST_F(RepeatedStructure, APoseThatIsOffByAPeriodIsWithdrawn) {
  constexpr double kPeriod = 0.2;
  build(kPeriod);
  double x = fly();
  TrackedFrame wrong = mislead(x += 0.01, kPeriod);
  ASSERT_EQ(wrong.state, TrackingState::kTracking);
  ASSERT_NEAR(error(wrong, x), kPeriod, 0.01) << "the test needs a wrong pose";
  EXPECT_LT(wrong.quality, 1.0);
  const KeyframeId keyframe = make_keyframe(wrong);
  const TrackedFrame next = track(whole(x += 0.01));
  ASSERT_EQ(next.state, TrackingState::kTracking);
  EXPECT_LT(error(next, x), 0.01);
  ASSERT_TRUE(next.withdrawal);
  EXPECT_NEAR(next.withdrawal->after, 0.5, 1e-9);
  EXPECT_EQ(next.withdrawal->keyframes, std::vector<KeyframeId>{keyframe});
  EXPECT_EQ(next.withdrawal->confirmed, KeyframeId{0});
  EXPECT_FALSE(track(whole(x + 0.01)).withdrawal);
}

// New landmarks that a wrong pose brings into the map fit it, and do not confirm it.
TEST_F(RepeatedStructure, LandmarksOfATentativeKeyframeDoNotConfirmIt) {
  constexpr double kPeriod = 0.2;
  build(kPeriod, 150);
  double x = fly();
  TrackedFrame wrong = mislead(x += 0.01, kPeriod, fresh_);
  ASSERT_NEAR(error(wrong, x), kPeriod, 0.01) << "the test needs a wrong pose";
  const KeyframeId keyframe = make_keyframe(wrong);
  x += 0.01;
  const TrackedFrame still_wrong = track(view(at(x), {repeated_, fresh_}));
  ASSERT_EQ(still_wrong.state, TrackingState::kTracking);
  ASSERT_GT(still_wrong.inliers, 100);
  ASSERT_NEAR(error(still_wrong, x), kPeriod, 0.01);
  x += 0.01;
  const TrackedFrame next = track(view(at(x), {unique_, repeated_, copies_, fresh_}));
  ASSERT_EQ(next.state, TrackingState::kTracking);
  EXPECT_LT(error(next, x), 0.01);
  ASSERT_TRUE(next.withdrawal);
  EXPECT_EQ(next.withdrawal->keyframes, std::vector<KeyframeId>{keyframe});
}

// A drone can move like that; what its image has in common with the next one shows where it was.
TEST_F(RepeatedStructure, SoIsOneThatTheMotionWouldAllow) {
  constexpr double kPeriod = 0.1;
  build(kPeriod);
  double x = fly();
  const TrackedFrame wrong = mislead(x += 0.01, kPeriod, fresh_);
  ASSERT_EQ(wrong.state, TrackingState::kTracking);
  ASSERT_NEAR(error(wrong, x), kPeriod, 0.01) << "the test needs a wrong pose";
  x += 0.01;
  const TrackedFrame next = track(view(at(x), {unique_, repeated_, copies_, fresh_}));
  ASSERT_EQ(next.state, TrackingState::kTracking);
  EXPECT_LT(error(next, x), 0.01);
  ASSERT_TRUE(next.withdrawal);
  EXPECT_TRUE(next.withdrawal->keyframes.empty());
}

TEST_F(RepeatedStructure, ARightPoseOfFewLandmarksStays) {
  build(0.2);
  double x = fly();
  for (int i = 0; i < 3; ++i) {
    const TrackedFrame few = track(view(at(x += 0.01), {repeated_}));
    ASSERT_EQ(few.state, TrackingState::kTracking);
    EXPECT_LT(error(few, x), 0.01);
    EXPECT_LT(few.quality, 1.0);
    EXPECT_FALSE(few.withdrawal);
  }
  EXPECT_FALSE(track(whole(x + 0.01)).withdrawal);
}

TrackedState state_at(double timestamp) {
  TrackedState state;
  state.frame.timestamp = timestamp;
  state.frame.reference = KeyframeId{7};
  return state;
}

TEST(TentativePoses, AreThoseSinceAStrongOne) {
  TentativePoses poses;
  EXPECT_EQ(poses.confirmed(1.0), nullptr);
  poses.add(state_at(1.0), false);  // the first, with nothing before it to return to
  EXPECT_EQ(poses.confirmed(1.05), nullptr);
  poses.add(state_at(1.1), false);
  poses.add_keyframe(KeyframeId{8});
  ASSERT_NE(poses.confirmed(1.15), nullptr);
  EXPECT_EQ(poses.confirmed(1.15)->frame.timestamp, 1.0);
  EXPECT_TRUE(poses.made(KeyframeId{8}));
  EXPECT_FALSE(poses.made(KeyframeId{7}));
  poses.add(state_at(1.2), true);
  EXPECT_EQ(poses.confirmed(1.25), nullptr);
  EXPECT_FALSE(poses.made(KeyframeId{8}));
}

TEST(TentativePoses, EndAfterHalfASecond) {
  TentativePoses poses;
  poses.add(state_at(1.0), true);
  for (const double time : {1.1, 1.2, 1.3, 1.4}) poses.add(state_at(time), false);
  EXPECT_NE(poses.confirmed(1.5), nullptr);
  EXPECT_EQ(poses.confirmed(5.0), nullptr) << "lost for long";
  poses.add(state_at(1.55), false);
  EXPECT_EQ(poses.confirmed(1.6), nullptr);
}

TEST(TentativePoses, FollowAKeyframeMadeOfAConfirmedFrame) {
  TentativePoses poses;
  poses.add(state_at(1.0), true);
  poses.add_keyframe(KeyframeId{9});
  poses.add(state_at(1.1), false);
  const Withdrawal withdrawal = poses.withdraw();
  EXPECT_EQ(withdrawal.after, 1.0);
  EXPECT_EQ(withdrawal.confirmed, KeyframeId{9});
  EXPECT_TRUE(withdrawal.keyframes.empty());
}

TEST(WithdrawnKeyframes, LeaveTheMapAndHaveNoPlace) {
  Map map({1.0F});
  auto view = std::make_shared<ObservedFrame>();
  view->pixels.resize(3, Eigen::Vector2f::Zero());
  view->descriptors.resize(3);
  view->levels.resize(3, 0);
  view->depths.resize(3, 2.0F);
  view->colours.assign(3, cv::Vec3b(0, 0, 0));
  const SE3 moved(Eigen::Quaterniond::Identity(), Vector3d(1, 0, 0));
  const KeyframeId right = map.add_keyframe(0, 0.0, SE3(), view);
  const KeyframeId wrong = map.add_keyframe(1, 0.1, moved, view);
  const LandmarkId of_both = map.add_landmark({0, 0, 2}, right, 0);
  map.add_observation(of_both, wrong, 0);
  const LandmarkId of_wrong = map.add_landmark({0, 1, 2}, wrong, 1);
  map.add_loop(right, wrong, moved);
  map.withdraw(wrong);
  EXPECT_TRUE(map.loops().empty());
  EXPECT_NE(map.find(wrong), nullptr) << "another thread may be working on it";
  map.remove_withdrawn(wrong);
  EXPECT_EQ(map.find(wrong), nullptr);
  EXPECT_TRUE(map.is_withdrawn(wrong));
  EXPECT_EQ(map.find(of_wrong), nullptr);
  ASSERT_NE(map.find(of_both), nullptr);
  EXPECT_EQ(map.find(of_both)->observations.size(), 1U);
  EXPECT_EQ(map.T_camera_world(wrong).translation(), moved.translation());  // for frames that refer to it
  KeyframePoseTable poses;
  poses.publish(map);
  const auto found = poses.find({right, wrong});
  EXPECT_TRUE(found[0].submap.is_valid());
  EXPECT_FALSE(found[1].submap.is_valid());
}

}  // namespace
}  // namespace roslam
