// SPDX-License-Identifier: BSD-3-Clause
// What the detection of dynamic objects remembers follows corrections of the map, changes of submap and
// resets of the clock: nothing of a static scene may seem to move.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "roslam/dynamic_objects/dynamic_object_detector.hpp"
#include "roslam/slam/front_end.hpp"
#include "tests/dynamic_scene.hpp"

namespace roslam::scene {
namespace {

constexpr double kRate = 15.0;           // frames a second
constexpr std::size_t kRemembered = 31;  // frames: two seconds
constexpr std::size_t kAfterwards = 15;  // frames: one second
constexpr Panel kBox{-0.6, -0.4, -0.1, 0.4, 2.0};

// T_new_old: maps coordinates before a correction to those after it. Sees the wall from half a metre farther
// away, so that what is there lies in space that the earlier frames saw through, if they are not corrected.
SE3 correction() {
  Vector6d tangent;
  tangent << 0.2, -0.05, 0.5, 0.02, 0.05, -0.01;
  return SE3::exp(tangent);
}

double share_of(const cv::Mat& mask) {
  return mask.empty() ? 0.0 : cv::countNonZero(mask) / static_cast<double>(mask.total());
}

constexpr double kBackground = 0.02;  // share of the image that is more than noise

class Correction : public testing::Test {
 protected:
  void use(bool depth_consistency, bool flow) {
    DynamicObjectDetector::Settings settings;
    settings.dynamic_objects = *options_of_mode("geometry");
    settings.dynamic_objects.depth_consistency = depth_consistency;
    settings.dynamic_objects.flow = flow;
    detector_.emplace(stage_.camera(), settings);
  }

  // The true pose of that frame, in the map as it is now.
  SE3 in_map(std::size_t index) const {
    const double t = static_cast<double>(index) / kRate;
    return turned(0.02 * t, {0.05 * t, 0.0, 0.03 * t}) * T_new_old_.inverse();
  }

  DynamicObjects play_one(const std::vector<Panel>& panels = room()) {
    Frame frame;
    frame.index = next_++;
    frame.timestamp = static_cast<double>(frame.index) / kRate - clock_began_;
    const SE3 pose = in_map(frame.index);
    view_ = stage_.show(panels, pose * T_new_old_);
    frame.depth = view_.depth;
    DynamicObjects objects = detector_->detect(frame, view_.grey, pose, {});
    const auto points = stage_.grid_points(objects.mask);
    detector_->remember(pose, points.outside, points.inside);
    return objects;
  }

  // The largest share of the image removed of several frames.
  double play(std::size_t frames, const std::vector<Panel>& panels = room()) {
    double largest = 0.0;
    for (std::size_t i = 0; i < frames; ++i) largest = std::max(largest, share_of(play_one(panels).mask));
    return largest;
  }

  // Two seconds of the static scene; the poses given afterwards are in the corrected map.
  void remember_then_correct(const SE3& T_new_old) {
    ASSERT_EQ(play(kRemembered), 0.0);
    T_new_old_ = T_new_old;
  }

  // A box that crosses the scene is still detected.
  void expect_mover_found() {
    double largest = 0.0;
    for (int i = 0; i < 12; ++i) {
      const DynamicObjects objects = play_one(room({kBox.shifted(0.05 * i)}));
      largest = std::max(largest, share_set(view_.shows(kThing), objects.mask));
    }
    EXPECT_GT(largest, 0.9);
  }

  // The source counts its time from 0 again.
  void restart_clock() { clock_began_ = static_cast<double>(next_) / kRate; }

  const Stage stage_;
  std::optional<DynamicObjectDetector> detector_;
  SE3 T_new_old_;  // of the corrections so far
  std::size_t next_ = 0;
  double clock_began_ = 0.0;  // seconds
  View view_;                 // of the last frame
};

// What a frame shows is compared with the depth of the last seconds.
class CorrectionOfDepth : public Correction {
 protected:
  CorrectionOfDepth() { use(true, false); }
};

TEST_F(CorrectionOfDepth, NothingMovesAfterACorrection) {
  remember_then_correct(correction());
  detector_->apply_correction(correction());
  EXPECT_EQ(play(kAfterwards), 0.0);
  expect_mover_found();
}

TEST_F(CorrectionOfDepth, NothingMovesAfterTwoCorrections) {
  remember_then_correct(correction() * correction());
  detector_->apply_correction(correction());
  detector_->apply_correction(correction());
  EXPECT_EQ(play(kAfterwards), 0.0);
}

TEST_F(CorrectionOfDepth, ControlWithoutTheCorrectionTheBackgroundSeemsToMove) {
  remember_then_correct(correction());
  EXPECT_GT(play(kAfterwards), kBackground);
}

TEST_F(CorrectionOfDepth, ControlWithTheInverseMotionTheBackgroundSeemsToMove) {
  remember_then_correct(correction());
  detector_->apply_correction(correction().inverse());
  EXPECT_GT(play(kAfterwards), kBackground);
}

TEST_F(CorrectionOfDepth, NothingMovesInAnotherSubmap) {
  remember_then_correct(correction());
  detector_->leave_submap();
  EXPECT_EQ(play(kAfterwards), 0.0);
  expect_mover_found();
}

TEST_F(CorrectionOfDepth, NothingMovesAfterAReset) {
  remember_then_correct(correction());
  restart_clock();
  detector_->reset();
  EXPECT_EQ(play(kAfterwards), 0.0);
  expect_mover_found();
}

TEST_F(CorrectionOfDepth, ControlWithoutTheResetTheBackgroundSeemsToMove) {
  remember_then_correct(correction());
  restart_clock();
  EXPECT_GT(play(kAfterwards), kBackground);
}

// A recording that is played again: what has stood there since its first frame did not come into the view.
TEST_F(CorrectionOfDepth, WhatStandsThereSinceAResetDoesNotMove) {
  remember_then_correct(SE3());
  restart_clock();
  detector_->reset();
  EXPECT_EQ(play(kAfterwards, room({kBox})), 0.0);
}

TEST_F(CorrectionOfDepth, ControlWithoutTheResetWhatStandsThereSeemsToHaveMoved) {
  remember_then_correct(SE3());
  restart_clock();
  EXPECT_GT(play(kAfterwards, room({kBox})), kBackground);
}

// The pose of a frame is estimated from that of the last one by optical flow, so that it tells in which
// coordinates the poses of past frames are.
class CorrectionOfPoses : public Correction {
 protected:
  CorrectionOfPoses() { use(true, true); }

  // Metres between the pose by optical flow of the next frame and the true one.
  std::optional<double> pose_error_of_next() {
    const SE3 T_world_camera = in_map(next_).inverse();
    const auto found = play_one().T_camera_world;
    if (!found) return std::nullopt;
    return (T_world_camera * *found).translation().norm();
  }
};

TEST_F(CorrectionOfPoses, TheyAreInTheCorrectedMap) {
  remember_then_correct(correction());
  detector_->apply_correction(correction());
  const auto error = pose_error_of_next();
  ASSERT_TRUE(error);
  EXPECT_LT(*error, 0.003);
  EXPECT_EQ(play(kAfterwards), 0.0);
  expect_mover_found();
}

TEST_F(CorrectionOfPoses, ControlWithoutTheCorrectionTheyAreInTheOldMap) {
  remember_then_correct(correction());
  const auto error = pose_error_of_next();
  ASSERT_TRUE(error);
  EXPECT_GT(*error, 0.3);
}

TEST_F(CorrectionOfPoses, TheyAreUnknownInAnotherSubmap) {
  remember_then_correct(correction());
  detector_->leave_submap();
  EXPECT_FALSE(pose_error_of_next());
  const auto error = pose_error_of_next();
  ASSERT_TRUE(error) << "from the first frame in the new submap";
  EXPECT_LT(*error, 0.003);
  EXPECT_EQ(play(kAfterwards), 0.0);
  expect_mover_found();
}

TEST_F(CorrectionOfPoses, TheyAreForgottenByAReset) {
  remember_then_correct(correction());
  restart_clock();
  detector_->reset();
  EXPECT_FALSE(pose_error_of_next());
  const auto error = pose_error_of_next();
  ASSERT_TRUE(error);
  EXPECT_LT(*error, 0.003);
  EXPECT_EQ(play(kAfterwards), 0.0);
  expect_mover_found();
}

// The camera flies ahead. After two seconds the view is hidden for a second, in which the pose is only
// predicted and the map is corrected; then it clears.
class CorrectionWhileHidden : public testing::Test {
 protected:
  CorrectionWhileHidden() {
    Options options;
    options.dynamic_objects = *options_of_mode("geometry");
    front_end_.emplace(stage_.camera(), options, Mode::kDeterministic, nullptr);
    map_.emplace(front_end_->level_scales());
  }

  static SE3 pose_at(std::size_t index) {
    const double t = static_cast<double>(index) / kRate;
    return turned(0.02 * t, {0.05 * t, 0.0, kSpeed * t - 1.5});
  }

  // T_camera_world of a measured frame in the map as it is now: it moves with its reference keyframe, as
  // Tracker::last_pose does.
  SE3 in_map(std::size_t index) const {
    return pose_at(index) * pose_at(0).inverse() * map_->T_camera_world(reference_);
  }

  // Moves the map as a loop closure does.
  void correct_map(const SE3& T_new_old) {
    Keyframe& keyframe = *map_->find(reference_);
    keyframe.T_camera_world = keyframe.T_camera_world * T_new_old.inverse();
    map_->note_correction();
  }

  // The next frame: seen and tracked, or hidden with a predicted pose. Returns the share that is removed.
  double play(bool is_hidden) {
    const std::size_t index = next_++;
    View view = stage_.show(room(), pose_at(index));
    if (is_hidden) {
      view.grey.setTo(90);
      view.depth.setTo(0.0F);
    }
    Frame frame;
    frame.index = index;
    frame.timestamp = static_cast<double>(index) / kRate;
    frame.depth = view.depth;
    cv::cvtColor(view.grey, frame.colour, cv::COLOR_GRAY2BGR);
    const bool has_pose = reference_.is_valid();
    const FrontEndResult observation =
        front_end_->observe(frame, {}, has_pose ? std::optional(in_map(index)) : std::nullopt, index);
    TrackedFrame tracked;
    tracked.state = is_hidden ? TrackingState::kPredicted : TrackingState::kTracking;
    tracked.timestamp = frame.timestamp;
    tracked.view = observation.view;
    tracked.inliers = is_hidden ? 0 : 300;
    if (!has_pose) reference_ = map_->add_keyframe(index, frame.timestamp, pose_at(index), observation.view);
    tracked.T_camera_world = in_map(index);
    tracked.reference = reference_;
    if (!is_hidden) last_measured_ = index;
    last_predicted_ = *tracked.T_camera_world;
    front_end_->remember(tracked, *map_, observation, false);
    return share_of(observation.dynamic_objects.mask);
  }

  // The largest share removed of several frames.
  double play(std::size_t frames, bool is_hidden) {
    double largest = 0.0;
    for (std::size_t i = 0; i < frames; ++i) largest = std::max(largest, play(is_hidden));
    return largest;
  }

  // Two seconds of flight, then frames with a predicted pose.
  void fly_and_hide() {
    ASSERT_EQ(play(kRemembered, false), 0.0);
    EXPECT_FALSE(front_end_->follow_corrections(*map_, in_map(last_measured_))) << "there was none";
    play(kHidden, true);
    ASSERT_EQ(last_measured_, kRemembered - 1);
  }

  // Tracking goes on from another keyframe, whose coordinates differ by that motion.
  void change_reference(SubmapId submap, const SE3& T_new_old) {
    const Keyframe& old = *map_->find(reference_);
    reference_ = map_->add_keyframe(next_, static_cast<double>(next_) / kRate,
                                    old.T_camera_world * T_new_old.inverse(), old.view, submap);
  }

  bool follow(const SE3& T_camera_world) { return front_end_->follow_corrections(*map_, T_camera_world); }

  static constexpr double kSpeed = 0.5;       // metres a second
  static constexpr std::size_t kHidden = 15;  // frames: one second

  const Stage stage_;
  std::optional<FrontEnd> front_end_;
  std::optional<Map> map_;
  KeyframeId reference_;
  std::size_t next_ = 0;
  std::size_t last_measured_ = 0;
  SE3 last_predicted_;  // T_camera_world of the last frame
};

TEST_F(CorrectionWhileHidden, NothingMovesWhenTheViewClears) {
  fly_and_hide();
  correct_map(correction());
  EXPECT_TRUE(follow(in_map(last_measured_)));
  EXPECT_FALSE(follow(in_map(last_measured_))) << "it was taken over before";
  EXPECT_EQ(play(kAfterwards, false), 0.0);
}

TEST_F(CorrectionWhileHidden, NothingMovesIfMoreFramesArePredictedAfterTheCorrection) {
  fly_and_hide();
  correct_map(correction());
  EXPECT_TRUE(follow(in_map(last_measured_)));
  play(3, true);
  EXPECT_EQ(play(kAfterwards, false), 0.0);
}

TEST_F(CorrectionWhileHidden, NothingMovesAfterASecondCorrection) {
  fly_and_hide();
  correct_map(correction());
  EXPECT_TRUE(follow(in_map(last_measured_)));
  play(3, true);
  correct_map(correction());
  EXPECT_TRUE(follow(in_map(last_measured_)));
  EXPECT_EQ(play(kAfterwards, false), 0.0);
}

// The correction is of the whole map, but no keyframe near the camera moved: nothing does.
TEST_F(CorrectionWhileHidden, ACorrectionThatMovesNothingHereLeavesThePastWhereItIs) {
  fly_and_hide();
  map_->note_correction();
  EXPECT_TRUE(follow(in_map(last_measured_)));
  EXPECT_EQ(play(kAfterwards, false), 0.0);
}

// The motion from the last predicted pose, instead of that of the last measured frame, contains the flight
// since then.
TEST_F(CorrectionWhileHidden, ControlWithTheMotionOfAPredictedFrameTheBackgroundSeemsToMove) {
  fly_and_hide();
  const SE3 measured = in_map(last_measured_);
  correct_map(correction());
  const SE3 T_new_old = in_map(last_measured_).inverse() * last_predicted_;
  EXPECT_TRUE(follow(measured * T_new_old.inverse()));
  EXPECT_GT(play(kAfterwards, false), kBackground);
}

TEST_F(CorrectionWhileHidden, ControlWithoutTheCorrectionTheBackgroundSeemsToMove) {
  fly_and_hide();
  correct_map(correction());
  EXPECT_GT(play(kAfterwards, false), kBackground);
}

TEST_F(CorrectionWhileHidden, NothingMovesIfTheViewClearsInAnotherSubmap) {
  fly_and_hide();
  change_reference(map_->new_submap(), correction());
  EXPECT_EQ(play(kAfterwards, false), 0.0);
}

// The same within one submap: as if the change of submap had not been noticed.
TEST_F(CorrectionWhileHidden, ControlWithinOneSubmapTheBackgroundSeemsToMove) {
  fly_and_hide();
  change_reference(map_->submap_of(reference_), correction());
  EXPECT_GT(play(kAfterwards, false), kBackground);
}

}  // namespace
}  // namespace roslam::scene
