// SPDX-License-Identifier: BSD-3-Clause
// A camera lost and back in an unmapped area: a new submap is started, and merged with the old one when
// keyframes of both overlap.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/slam/slam.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam {

using namespace simulation;
namespace {

constexpr std::size_t kLost = 25;     // first frame that is missing
constexpr std::size_t kBack = 120;    // first frame after it, two thirds of a turn on
constexpr std::size_t kTurn = 180;    // frames of a whole turn
constexpr std::size_t kEnd = 210;     // of the flight
constexpr std::size_t kPatience = 5;  // frames without relocalisation before a new submap

// A turn on the spot, part of which is missing.
class NewSubmap : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    Simulator simulator({.path = FlightPath::kHover, .traffic = TrafficLevel::kNone, .fps = 10.0});
    frames_ = std::make_unique<std::vector<Frame>>();
    for (std::size_t i = 0; i < kEnd; i = i + 1 == kLost ? kBack : i + 1)
      frames_->push_back(simulator.render(i).frame);
  }
  static void TearDownTestSuite() { frames_.reset(); }

  static std::unique_ptr<Slam> make_slam(Mode mode = Mode::kDeterministic) {
    Options options;
    options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
    options.tracker.new_submap_after_lost = kPatience;
    return std::make_unique<Slam>(
        *camera_preset("simulated"), options, mode, nullptr,
        std::make_shared<const Vocabulary>(Vocabulary::load(ROSLAM_TEST_MODELS "/roslam-orb.vocabulary")));
  }

  // True T_first_camera at a time.
  static SE3 truth_at(double time) {
    const auto frame = std::find_if(frames_->begin(), frames_->end(),
                                    [&](const Frame& candidate) { return candidate.timestamp == time; });
    return frames_->front().T_world_camera->inverse() * *frame->T_world_camera;
  }

  static void expect_true(const SE3& T_first_camera, double time) {
    const SE3 error = truth_at(time).inverse() * T_first_camera;
    EXPECT_LT(error.translation().norm(), 0.1) << time;
    EXPECT_LT(error.angle(), 0.02) << time;
  }

  inline static std::unique_ptr<std::vector<Frame>> frames_;
};

TEST_F(NewSubmap, BecomesOneWithTheOldWhereTheyMeet) {
  const auto slam = make_slam();
  std::size_t in_new_submap = 0;
  for (const Frame& frame : *frames_) {
    const auto result = slam->process(frame);
    ASSERT_TRUE(result.is_used());
    if (!result.T_world_camera || frame.index < kBack || !slam->loops().empty()) continue;
    EXPECT_EQ(result.submap, SubmapId{1}) << frame.index;
    EXPECT_EQ(slam->map().submaps().size(), 2U) << frame.index;
    ++in_new_submap;
  }
  slam->finish();
  EXPECT_GT(in_new_submap, 20U);
  ASSERT_FALSE(slam->loops().empty());
  EXPECT_TRUE(slam->loops().front().merges_submaps);
  EXPECT_EQ(slam->map().submaps(), std::vector<SubmapId>{SubmapId{0}});
  EXPECT_TRUE(slam->frames_in_other_submaps().empty());
  // All frames but those lost, each at its true pose relative to the first.
  const Trajectory poses = slam->trajectory();
  ASSERT_EQ(poses.size(), kLost + (kEnd - kBack) - (kPatience - 1));
  for (const auto& pose : poses)
    expect_true(poses.front().T_world_camera.inverse() * pose.T_world_camera, pose.timestamp);
}

TEST_F(NewSubmap, OfAnotherFlightJoinsTheMapThatItWentOnFrom) {
  const auto first = make_slam();
  for (std::size_t i = 0; i < kLost; ++i) ASSERT_TRUE(first->process((*frames_)[i]).is_used());
  first->finish();
  const SE3 T_map_first = first->trajectory().front().T_world_camera;

  const auto second = make_slam();
  second->load_map(first->saved_map());
  for (std::size_t i = kLost; i < frames_->size(); ++i) {
    ASSERT_TRUE(second->process((*frames_)[i]).is_used());
    // Neither before a new submap is started nor within it.
    if (i == kLost + 2 || (*frames_)[i].index == kBack + 30) {
      EXPECT_FALSE(second->found_in_loaded_map());
    }
  }
  second->finish();
  EXPECT_TRUE(second->found_in_loaded_map());
  EXPECT_EQ(second->map().submaps().size(), 1U);
  const Trajectory poses = second->trajectory();
  EXPECT_EQ(poses.size(), (kEnd - kBack) - (kPatience - 1));
  for (const auto& pose : poses) expect_true(T_map_first.inverse() * pose.T_world_camera, pose.timestamp);
}

// Tracker, mapper and loop closer on threads of their own, as fast as they can.
TEST_F(NewSubmap, BecomesOneWithTheOldOnThreads) {
  const auto slam = make_slam(Mode::kRealTime);
  std::size_t tracked = 0;
  for (const Frame& frame : *frames_) {
    const auto result = slam->process(frame);
    ASSERT_TRUE(result.is_used());
    tracked += result.T_world_camera ? 1 : 0;
  }
  slam->finish();
  EXPECT_GE(tracked, frames_->size() - 2 * kPatience);
  EXPECT_EQ(slam->map().submaps().size(), 1U);
  const Trajectory poses = slam->trajectory();
  EXPECT_EQ(poses.size(), tracked);
  for (const auto& pose : poses)
    expect_true(poses.front().T_world_camera.inverse() * pose.T_world_camera, pose.timestamp);
}

}  // namespace
}  // namespace roslam
