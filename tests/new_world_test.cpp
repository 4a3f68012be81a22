// SPDX-License-Identifier: BSD-3-Clause
// A camera that comes back where it never was: it begins a new world, which becomes one with the old as soon
// as a place of that is seen again.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "roslam/pipeline/slam.hpp"
#include "roslam/removal/removal_options.hpp"
#include "roslam/sources/simulated_source.hpp"

namespace roslam {
namespace {

constexpr std::size_t kLost = 25;     // first frame that is missing
constexpr std::size_t kBack = 120;    // first frame after it, two thirds of a turn on
constexpr std::size_t kTurn = 180;    // frames of a whole turn
constexpr std::size_t kEnd = 210;     // of the flight
constexpr std::size_t kPatience = 5;  // frames unrecognised before a new world begins

// A turn on the spot, part of which is missing.
class NewWorld : public testing::Test {
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
    options.removal = *removal_from("none", options.removal);
    options.tracker.new_world_frames = kPatience;
    return std::make_unique<Slam>(
        *camera_preset("simulated"), options, mode, nullptr,
        std::make_shared<const Vocabulary>(Vocabulary::load(ROSLAM_TEST_MODELS "/roslam-orb.vocabulary")));
  }

  // Where the camera was at a time, as seen from the first frame.
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

TEST_F(NewWorld, BecomesOneWithTheOldWhereTheyMeet) {
  const auto slam = make_slam();
  std::size_t in_new_world = 0;
  for (const Frame& frame : *frames_) {
    const auto result = slam->process(frame);
    ASSERT_TRUE(result);
    if (!result->T_world_camera || frame.index < kBack || !slam->loops().empty()) continue;
    EXPECT_EQ(result->world, WorldId{1}) << frame.index;
    EXPECT_EQ(slam->map().worlds().size(), 2U) << frame.index;
    ++in_new_world;
  }
  slam->finish();
  EXPECT_GT(in_new_world, 20U);
  ASSERT_FALSE(slam->loops().empty());
  EXPECT_TRUE(slam->loops().front().joins);
  EXPECT_EQ(slam->map().worlds(), std::vector<WorldId>{WorldId{0}});
  EXPECT_TRUE(slam->frames_apart().empty());
  // All frames but those it was lost for, each where it truly was, in the world of the first.
  const Trajectory poses = slam->trajectory();
  ASSERT_EQ(poses.size(), kLost + (kEnd - kBack) - (kPatience - 1));
  for (const auto& pose : poses)
    expect_true(poses.front().T_world_camera.inverse() * pose.T_world_camera, pose.timestamp);
}

TEST_F(NewWorld, OfAnotherFlightJoinsTheMapThatItWentOnFrom) {
  const auto first = make_slam();
  for (std::size_t i = 0; i < kLost; ++i) ASSERT_TRUE(first->process((*frames_)[i]));
  first->finish();
  const SE3 T_map_first = first->trajectory().front().T_world_camera;

  const auto second = make_slam();
  second->continue_from(first->snapshot());
  for (std::size_t i = kLost; i < frames_->size(); ++i) {
    ASSERT_TRUE(second->process((*frames_)[i]));
    // Neither before it begins a world of its own nor in that world.
    if (i == kLost + 2 || (*frames_)[i].index == kBack + 30) {
      EXPECT_FALSE(second->has_met_map());
    }
  }
  second->finish();
  EXPECT_TRUE(second->has_met_map());
  EXPECT_EQ(second->map().worlds().size(), 1U);
  const Trajectory poses = second->trajectory();
  EXPECT_EQ(poses.size(), (kEnd - kBack) - (kPatience - 1));
  for (const auto& pose : poses) expect_true(T_map_first.inverse() * pose.T_world_camera, pose.timestamp);
}

// Tracker, mapper and loop closer on threads of their own, as fast as they can.
TEST_F(NewWorld, BecomesOneWithTheOldOnThreads) {
  const auto slam = make_slam(Mode::kRealTime);
  std::size_t tracked = 0;
  for (const Frame& frame : *frames_) {
    const auto result = slam->process(frame);
    ASSERT_TRUE(result);
    tracked += result->T_world_camera ? 1 : 0;
  }
  slam->finish();
  EXPECT_GE(tracked, frames_->size() - 2 * kPatience);
  EXPECT_EQ(slam->map().worlds().size(), 1U);
  const Trajectory poses = slam->trajectory();
  EXPECT_EQ(poses.size(), tracked);
  for (const auto& pose : poses)
    expect_true(poses.front().T_world_camera.inverse() * pose.T_world_camera, pose.timestamp);
}

}  // namespace
}  // namespace roslam
