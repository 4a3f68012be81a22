// SPDX-License-Identifier: BSD-3-Clause
// A map of a place grows with the place, not with the time spent there.
#include <gtest/gtest.h>

#include "roslam/atlas/map_file.hpp"
#include "roslam/pipeline/slam.hpp"
#include "roslam/removal/removal_options.hpp"
#include "roslam/sources/simulated_source.hpp"

namespace roslam {
namespace {

TEST(LongFlight, TheSecondTurnOnTheSpotAddsLittle) {
  constexpr std::size_t kTurn = 108;  // frames
  Simulator simulator({.path = FlightPath::kHover, .traffic = TrafficLevel::kNone, .fps = 6.0});
  Options options;
  options.removal = *removal_from("none", options.removal);
  Slam slam(
      simulator.camera(), options, Mode::kDeterministic, nullptr,
      std::make_shared<const Vocabulary>(Vocabulary::load(ROSLAM_TEST_MODELS "/roslam-orb.vocabulary")));
  std::size_t keyframes = 0;
  std::size_t landmarks = 0;
  for (std::size_t i = 0; i < 2 * kTurn - 1; ++i) {
    const auto result = slam.process(simulator.render(i).frame);
    ASSERT_TRUE(result && result->T_world_camera) << i;
    if (i + 1 != kTurn) continue;
    keyframes = slam.map().keyframe_count();
    landmarks = slam.map().landmark_count();
  }
  slam.finish();
  EXPECT_GE(slam.loops().size(), 1U) << "the first turn ends where it began";
  EXPECT_EQ(slam.map().worlds().size(), 1U);
  EXPECT_LT(slam.map().keyframe_count(), 1.3 * static_cast<double>(keyframes));
  EXPECT_LT(slam.map().landmark_count(), 1.3 * static_cast<double>(landmarks));
  // What a keyframe costs, its share of the landmarks included.
  const std::size_t bytes = encode_map(slam.snapshot()).size() / slam.map().keyframe_count();
  EXPECT_LT(bytes, 120'000U);
  RecordProperty("keyframes_first_turn", static_cast<int>(keyframes));
  RecordProperty("keyframes", static_cast<int>(slam.map().keyframe_count()));
}

}  // namespace
}  // namespace roslam
