// SPDX-License-Identifier: BSD-3-Clause
// Real-time mode: every frame is accounted for, and late ones are dropped rather than queued.
#include <gtest/gtest.h>

#include "tests/street.hpp"

namespace roslam::street {
namespace {

class RealTime : public Dataset {
 protected:
  // The frame counts; expects them to add up.
  nlohmann::json run_and_add_up(const std::string& arguments, std::size_t skipped) const {
    nlohmann::json frames = frames_of_run("--real-time " + arguments);
    const auto processed = frames["processed"].get<std::size_t>();
    const auto dropped = frames["dropped"].get<std::size_t>();
    EXPECT_EQ(processed + dropped + skipped, colour_.size());
    EXPECT_EQ(frames["in_source"], colour_.size());
    const Trajectory poses = trajectory();
    EXPECT_EQ(poses.size(), frames["tracked"].get<std::size_t>());
    for (std::size_t i = 1; i < poses.size(); ++i) EXPECT_GT(poses[i].timestamp, poses[i - 1].timestamp);
    return frames;
  }
};

TEST_F(RealTime, AccountsForEveryFrame) {
  make(kBeforeGap);
  fs::remove(colour(7));
  fs::remove(colour(8));
  put(depth(20), "");
  const auto frames = run_and_add_up("", 2);
  EXPECT_GT(frames["tracked"], 10);          // a machine that is busy with other things drops some
  EXPECT_GE(report()["wall_seconds"], 1.9);  // at the pace of the camera
  EXPECT_EQ(report()["mode"], "real-time");
}

TEST_F(RealTime, DropsFramesWhenTrackingIsTooSlow) {
  make(kBeforeGap);
  for (std::size_t i = 0; i < colour_.size(); ++i) {  // ten times as fast as the camera
    colour_[i].time = std::to_string(0.1 * std::stod(colour_[i].time));
    depth_[i].time = std::to_string(0.1 * std::stod(depth_[i].time));
  }
  write_lists();
  put(scratch_ / "slow.yaml", "orb:\n  features: 8000\n");
  const auto frames = run_and_add_up("--config '" + (scratch_ / "slow.yaml").string() + "'", 0);
  EXPECT_GT(frames["dropped"], 5);
  EXPECT_GT(frames["tracked"], 2);
}

}  // namespace
}  // namespace roslam::street
