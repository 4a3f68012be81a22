// SPDX-License-Identifier: BSD-3-Clause
// The size of a map depends on the area mapped, not on the time spent there.
#include <gtest/gtest.h>

#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/slam/slam.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam {

using namespace simulation;
namespace {

TEST(LongFlight, TheSecondTurnOnTheSpotAddsLittle) {
  constexpr std::size_t kTurn = 108;  // frames
  Simulator simulator({.path = FlightPath::kHover, .traffic = TrafficLevel::kNone, .fps = 6.0});
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  Slam slam(
      simulator.camera(), options, Mode::kDeterministic, nullptr,
      std::make_shared<const Vocabulary>(Vocabulary::load(ROSLAM_TEST_MODELS "/roslam-orb.vocabulary")));
  std::size_t keyframes = 0;
  std::size_t landmarks = 0;
  for (std::size_t i = 0; i < 2 * kTurn - 1; ++i) {
    const auto result = slam.process(simulator.render(i).frame);
    ASSERT_TRUE(result.T_world_camera) << i;
    if (i + 1 != kTurn) continue;
    keyframes = slam.map().keyframe_count();
    landmarks = slam.map().landmark_count();
  }
  slam.finish();
  EXPECT_GE(slam.loops().size(), 1U) << "the first turn ends where it began";
  EXPECT_EQ(slam.map().submaps().size(), 1U);
  EXPECT_LT(slam.map().keyframe_count(), 1.3 * static_cast<double>(keyframes));
  EXPECT_LT(slam.map().landmark_count(), 1.3 * static_cast<double>(landmarks));
  // Bytes a keyframe, its share of the landmarks included.
  const std::size_t bytes = encode_map(slam.saved_map()).size() / slam.map().keyframe_count();
  EXPECT_LT(bytes, 120'000U);
  RecordProperty("keyframes_first_turn", static_cast<int>(keyframes));
  RecordProperty("keyframes", static_cast<int>(slam.map().keyframe_count()));
}

}  // namespace
}  // namespace roslam
