// SPDX-License-Identifier: BSD-3-Clause
// Which frames become keyframes: each rule alone, beside a case in which only that rule does not apply.
#include "roslam/tracking/keyframe_policy.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "roslam/common/error.hpp"

namespace roslam {
namespace {

constexpr int kReferenceLandmarks = 100;
constexpr bool kIdle = true;
constexpr bool kBusy = false;

// What a frame shows; by default nothing that calls for a keyframe.
struct Shown {
  double timestamp = 0.5;  // the last keyframe is of time 0
  int inliers = 80;
  int tracked_near = 120;
  int new_near = 0;
  double new_depth = 2.0;  // metres, of the points without a landmark
  int hidden = 0;
};

void add_points(ObservedFrame& view, int count, double depth) {
  const std::size_t size = view.size() + static_cast<std::size_t>(count);
  view.pixels.resize(size, Eigen::Vector2f::Zero());
  view.depths.resize(size, static_cast<float>(depth));
  view.levels.resize(size, 0);
  view.angles.resize(size, 0.0F);
  view.colours.resize(size);
  view.descriptors.resize(size);
}

class KeyframePolicyTest : public testing::Test {
 protected:
  KeyframePolicyTest() {
    auto view = std::make_shared<ObservedFrame>();
    add_points(*view, kReferenceLandmarks + 20, 2.0);
    reference_ = map_.add_keyframe(0, 0.0, SE3(), view);
    for (std::uint32_t i = 0; i < kReferenceLandmarks; ++i) map_.add_landmark({0, 0, 2}, reference_, i);
  }

  TrackedFrame frame(const Shown& shown) const {
    auto view = std::make_shared<ObservedFrame>();
    TrackedFrame result;
    add_points(*view, shown.tracked_near, 2.0);
    result.landmarks.assign(view->size(), LandmarkId{0});
    add_points(*view, shown.new_near, shown.new_depth);
    result.landmarks.resize(view->size());
    result.state = TrackingState::kTracking;
    result.timestamp = shown.timestamp;
    result.view = view;
    result.T_camera_world = SE3();
    result.inliers = shown.inliers;
    result.hidden = shown.hidden;
    result.reference = reference_;
    return result;
  }

  bool needs(const Shown& shown, bool mapper_idle, const KeyframePolicyOptions& options = {}) const {
    return KeyframePolicy(options).needs_keyframe(frame(shown), map_, mapper_idle);
  }

  Map map_{{1.0F, 1.2F}};
  KeyframeId reference_;
};

TEST_F(KeyframePolicyTest, LostOverlapNeedsOne) {
  EXPECT_FALSE(needs({.inliers = 61}, kIdle));
  EXPECT_TRUE(needs({.inliers = 59}, kIdle));
  EXPECT_FALSE(needs({.inliers = 59}, kIdle, {.min_overlap = 0.5}));
}

TEST_F(KeyframePolicyTest, ABusyMapperPutsItOff) {
  EXPECT_TRUE(needs({.inliers = 50}, kIdle));
  EXPECT_FALSE(needs({.inliers = 50}, kBusy));
}

TEST_F(KeyframePolicyTest, AfterMaxIntervalABusyMapperDoesNotPutItOff) {
  EXPECT_FALSE(needs({.timestamp = 0.99, .inliers = 50}, kBusy));
  EXPECT_TRUE(needs({.timestamp = 1.0, .inliers = 50}, kBusy));
  EXPECT_FALSE(needs({.timestamp = 1.0, .inliers = 80}, kBusy)) << "time alone is no reason";
  EXPECT_FALSE(needs({.timestamp = 1.0, .inliers = 80}, kIdle)) << "time alone is no reason";
}

TEST_F(KeyframePolicyTest, ABusyMapperDoesNotPutItOffWhereTrackingIsWeak) {
  EXPECT_FALSE(needs({.inliers = 26}, kBusy));
  EXPECT_TRUE(needs({.inliers = 24}, kBusy));
}

TEST_F(KeyframePolicyTest, FewNearLandmarksAndManyNewNearPointsNeedOne) {
  EXPECT_TRUE(needs({.tracked_near = 99, .new_near = 71}, kBusy));
  EXPECT_FALSE(needs({.tracked_near = 100, .new_near = 71}, kBusy));
  EXPECT_FALSE(needs({.tracked_near = 99, .new_near = 70}, kBusy));
  EXPECT_TRUE(needs({.tracked_near = 99, .new_near = 71, .new_depth = 2.9}, kBusy));
  EXPECT_FALSE(needs({.tracked_near = 99, .new_near = 71, .new_depth = 3.1}, kBusy)) << "not near";
  EXPECT_TRUE(needs({.tracked_near = 99, .new_near = 71, .new_depth = 3.1}, kBusy, {.near = 4.0}));
  EXPECT_FALSE(needs({.tracked_near = 99, .new_near = 71, .new_depth = 0.0}, kBusy)) << "depth unknown";
}

TEST_F(KeyframePolicyTest, NoneWithinMinInterval) {
  const KeyframePolicyOptions options{.min_interval = 0.3};
  const Shown reasons{.timestamp = 0.29, .inliers = 20, .tracked_near = 20, .new_near = 200};
  EXPECT_FALSE(needs(reasons, kIdle, options));
  EXPECT_TRUE(needs(reasons, kIdle));
  Shown later = reasons;
  later.timestamp = 0.31;
  EXPECT_TRUE(needs(later, kIdle, options));
}

TEST_F(KeyframePolicyTest, TheFirstFrameOfASubmapIsOne) {
  const KeyframePolicy policy({.min_interval = 1.0});
  TrackedFrame first = frame({});
  EXPECT_FALSE(policy.needs_keyframe(first, map_, kBusy));
  first.reference = {};
  EXPECT_TRUE(policy.needs_keyframe(first, map_, kBusy)) << "even within min_interval";
}

TEST_F(KeyframePolicyTest, NoneIfDisabled) {
  const KeyframePolicy disabled({.enabled = false});
  const KeyframePolicy enabled({});
  TrackedFrame lost_overlap = frame({.timestamp = 5.0, .inliers = 20});
  EXPECT_TRUE(enabled.needs_keyframe(lost_overlap, map_, kIdle));
  EXPECT_FALSE(disabled.needs_keyframe(lost_overlap, map_, kIdle));
  TrackedFrame first = lost_overlap;
  first.reference = {};
  EXPECT_TRUE(enabled.needs_keyframe(first, map_, kIdle));
  EXPECT_FALSE(disabled.needs_keyframe(first, map_, kIdle));
}

TEST_F(KeyframePolicyTest, HiddenLandmarksAreNoLostOverlap) {
  EXPECT_TRUE(needs({.inliers = 50}, kIdle));
  EXPECT_FALSE(needs({.inliers = 50, .hidden = 20}, kIdle));
  EXPECT_TRUE(needs({.inliers = 47, .hidden = 20}, kIdle)) << "below 0.6 of the 80 in view";
  EXPECT_FALSE(needs({.inliers = 0, .hidden = kReferenceLandmarks}, kIdle));
}

TEST_F(KeyframePolicyTest, OnlyWhereTheFrameWasTracked) {
  const KeyframePolicy policy({});
  TrackedFrame lost_overlap = frame({.timestamp = 5.0, .inliers = 20});
  EXPECT_TRUE(policy.needs_keyframe(lost_overlap, map_, kIdle));
  for (const TrackingState state : {TrackingState::kInitialising, TrackingState::kPredicted,
                                    TrackingState::kRecentlyLost, TrackingState::kLost}) {
    lost_overlap.state = state;
    EXPECT_FALSE(policy.needs_keyframe(lost_overlap, map_, kIdle)) << name_of(state);
  }
}

TEST_F(KeyframePolicyTest, IntervalsCountFromTheLastKeyframe) {
  KeyframePolicy policy({.min_interval = 0.3});
  const TrackedFrame before = frame({.timestamp = 4.0, .inliers = 50});
  EXPECT_TRUE(policy.needs_keyframe(before, map_, kBusy));
  policy.keyframe_created(before);
  EXPECT_FALSE(policy.needs_keyframe(frame({.timestamp = 4.2, .inliers = 50}), map_, kIdle));
  EXPECT_FALSE(policy.needs_keyframe(frame({.timestamp = 4.9, .inliers = 50}), map_, kBusy));
  EXPECT_TRUE(policy.needs_keyframe(frame({.timestamp = 5.1, .inliers = 50}), map_, kBusy));
}

// A source that starts again sends timestamps before that of the last keyframe.
TEST_F(KeyframePolicyTest, IntervalsCountFromAClockThatWasReset) {
  KeyframePolicy policy({});
  policy.keyframe_created(frame({.timestamp = 100.0}));
  const TrackedFrame lost_overlap = frame({.timestamp = 6.0, .inliers = 20});
  EXPECT_FALSE(policy.needs_keyframe(lost_overlap, map_, kIdle)) << "before the last keyframe";
  policy.restart_clock(5.0);
  EXPECT_TRUE(policy.needs_keyframe(lost_overlap, map_, kIdle));
  EXPECT_FALSE(policy.needs_keyframe(frame({.timestamp = 5.9, .inliers = 50}), map_, kBusy));
  EXPECT_TRUE(policy.needs_keyframe(frame({.timestamp = 6.1, .inliers = 50}), map_, kBusy));
}

TEST_F(KeyframePolicyTest, RefusesOptionsOutOfRange) {
  EXPECT_NO_THROW(KeyframePolicy({.max_interval = 1.0, .min_interval = 1.0}));
  EXPECT_THROW(KeyframePolicy({.max_interval = 1.0, .min_interval = 1.1}), OptionsError);
}

// Landmarks before a camera at the origin, on a row across the image.
class HiddenLandmarks : public testing::Test {
 protected:
  // At that undistorted pixel, metres along the optical axis.
  LandmarkId add(const Eigen::Vector2d& pixel, double depth) {
    return map_.add_landmark(camera_.unproject(pixel, depth), frame_.reference, next_++);
  }

  void SetUp() override {
    auto view = std::make_shared<ObservedFrame>();
    add_points(*view, 10, 2.0);
    frame_.reference = map_.add_keyframe(0, 0.0, SE3(), view);
    frame_.state = TrackingState::kTracking;
    frame_.T_camera_world = SE3();
  }

  int count(const cv::Mat& mask) const { return count_hidden_landmarks(map_, frame_, camera_, mask); }

  cv::Mat left_half() const {
    cv::Mat mask(camera_.height, camera_.width, CV_8UC1, cv::Scalar(0));
    mask.colRange(0, camera_.width / 2) = 255;
    return mask;
  }

  Camera camera_;
  Map map_{{1.0F, 1.2F}};
  TrackedFrame frame_;
  std::uint32_t next_ = 0;
};

TEST_F(HiddenLandmarks, AreThoseThatProjectIntoTheMask) {
  add({100.0, 200.0}, 2.0);
  add({200.0, 300.0}, 3.0);
  add({300.0, 100.0}, 4.0);
  add({400.0, 200.0}, 2.0);
  add({600.0, 200.0}, 2.0);
  EXPECT_EQ(count(left_half()), 3);
  EXPECT_EQ(count(cv::Mat::zeros(camera_.height, camera_.width, CV_8UC1)), 0);
  EXPECT_EQ(count(cv::Mat::ones(camera_.height, camera_.width, CV_8UC1)), 5);
  EXPECT_EQ(count(cv::Mat()), 0);
}

TEST_F(HiddenLandmarks, AreSeenFromThePoseOfTheFrame) {
  add({400.0, 200.0}, 2.0);
  EXPECT_EQ(count(left_half()), 0);
  frame_.T_camera_world = SE3(Eigen::Quaterniond::Identity(), {-1.0, 0.0, 0.0});  // a metre to the right
  EXPECT_EQ(count(left_half()), 1);
  frame_.T_camera_world.reset();
  EXPECT_EQ(count(left_half()), 0);
}

TEST_F(HiddenLandmarks, LieBeforeTheCameraAndInTheImage) {
  const cv::Mat everywhere = cv::Mat::ones(camera_.height, camera_.width, CV_8UC1);
  add({100.0, 200.0}, 2.0);
  EXPECT_EQ(count(everywhere), 1);
  add({100.0, 200.0}, -2.0);
  add({-5.0, 200.0}, 2.0);
  add({645.0, 200.0}, 2.0);
  add({100.0, -5.0}, 2.0);
  add({100.0, 485.0}, 2.0);
  EXPECT_EQ(count(everywhere), 1);
}

TEST_F(HiddenLandmarks, AreThoseOfTheReference) {
  const LandmarkId removed = add({100.0, 200.0}, 2.0);
  add({150.0, 200.0}, 2.0);
  EXPECT_EQ(count(left_half()), 2);
  map_.remove_landmark(removed);
  EXPECT_EQ(count(left_half()), 1);
  frame_.reference = {};
  EXPECT_EQ(count(left_half()), 0);
  frame_.reference = KeyframeId{7};
  EXPECT_EQ(count(left_half()), 0) << "an id that was never given out";
}

// The mask is of the image as taken, landmarks project to undistorted pixels.
TEST_F(HiddenLandmarks, LieInTheImageAsTaken) {
  camera_ = *camera_preset("tum-fr1");
  const Eigen::Vector2d pixel(60.0, 50.0);
  const Eigen::Vector2d raw = camera_.distort(pixel);
  ASSERT_GT((raw - pixel).norm(), 6.0);
  add(pixel, 2.0);
  const auto mask_around = [&](const Eigen::Vector2d& centre) {
    cv::Mat mask(camera_.height, camera_.width, CV_8UC1, cv::Scalar(0));
    mask(cv::Rect(cvRound(centre.x()) - 1, cvRound(centre.y()) - 1, 3, 3)) = 255;
    return mask;
  };
  EXPECT_EQ(count(mask_around(raw)), 1);
  EXPECT_EQ(count(mask_around(pixel)), 0);
}

}  // namespace
}  // namespace roslam
