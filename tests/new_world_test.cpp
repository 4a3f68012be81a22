// SPDX-License-Identifier: BSD-3-Clause
// A camera that comes back where it never was: it begins a new world, which becomes one with the old as soon
// as a place of that is seen again.
#include <gtest/gtest.h>

#include <memory>

#include "roslam/pipeline/slam.hpp"
#include "roslam/removal/removal_options.hpp"
#include "roslam/sources/simulated_source.hpp"

namespace roslam {
namespace {

constexpr std::size_t kLost = 25;     // first frame that is missing
constexpr std::size_t kBack = 120;    // first frame after it, two thirds of a turn on
constexpr std::size_t kTurn = 180;    // frames of a whole turn
constexpr std::size_t kPatience = 5;  // frames unrecognised before a new world begins

TEST(NewWorld, BecomesOneWithTheOldWhereTheyMeet) {
  Simulator simulator({.path = FlightPath::kHover, .traffic = TrafficLevel::kNone, .fps = 10.0});
  Options options;
  options.removal = *removal_from("none", options.removal);
  options.tracker.new_world_frames = kPatience;
  Slam slam(
      simulator.camera(), options, Mode::kDeterministic, nullptr,
      std::make_shared<const Vocabulary>(Vocabulary::load(ROSLAM_TEST_MODELS "/roslam-orb.vocabulary")));
  Trajectory truth;
  std::size_t in_new_world = 0;
  for (std::size_t i = 0; i < kTurn + 30; i = i + 1 == kLost ? kBack : i + 1) {
    const Frame frame = simulator.render(i).frame;
    const auto result = slam.process(frame);
    ASSERT_TRUE(result);
    if (!result->T_world_camera) continue;
    truth.push_back({frame.timestamp, *frame.T_world_camera});
    if (i >= kBack && slam.loops().empty()) {
      EXPECT_EQ(result->world, WorldId{1}) << i;
      EXPECT_EQ(slam.map().worlds().size(), 2U) << i;
      ++in_new_world;
    }
  }
  slam.finish();
  EXPECT_GT(in_new_world, 20U);
  ASSERT_FALSE(slam.loops().empty());
  EXPECT_TRUE(slam.loops().front().joins);
  EXPECT_EQ(slam.map().worlds(), std::vector<WorldId>{WorldId{0}});
  EXPECT_TRUE(slam.frames_apart().empty());

  // All frames but those it was lost for, each where it truly was, in the world of the first.
  const Trajectory poses = slam.trajectory();
  ASSERT_EQ(poses.size(), kLost + (kTurn + 30 - kBack) - (kPatience - 1));
  ASSERT_EQ(truth.size(), poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    ASSERT_EQ(poses[i].timestamp, truth[i].timestamp);
    const SE3 moved = poses[0].T_world_camera.inverse() * poses[i].T_world_camera;
    const SE3 truly = truth[0].T_world_camera.inverse() * truth[i].T_world_camera;
    EXPECT_LT((truly.inverse() * moved).translation().norm(), 0.1) << i;
    EXPECT_LT((truly.inverse() * moved).angle(), 0.02) << i;
  }
}

}  // namespace
}  // namespace roslam
