// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/inertial_queue.hpp"

#include <gtest/gtest.h>

namespace roslam {
namespace {

constexpr double kRate = 400.0;

InertialSample sample_at(double time) {
  InertialSample sample;
  sample.timestamp = time;
  sample.turn_rate.x() = time;
  return sample;
}

// Feeds samples of a clock, of which some are wrong, and takes them at 30 frames a second; returns how many
// frames have as many samples as are due, give or take one.
int complete_frames(double begin, int frames, const std::map<int, double>& wrong, InertialQueue& queue,
                    int segment = 0) {
  int sample = 0, complete = 0;
  for (int frame = 1; frame <= frames; ++frame) {
    const double time = begin + frame / 30.0;
    for (; begin + sample / kRate <= time + 0.01; ++sample) {
      const auto found = wrong.find(sample);
      queue.add(sample_at(begin + sample / kRate + (found == wrong.end() ? 0.0 : found->second)));
    }
    const auto taken = queue.take_until(time, segment);
    for (const InertialSample& one : taken) EXPECT_LE(one.timestamp, time);
    complete += taken.size() >= 12 && taken.size() <= 15 ? 1 : 0;
  }
  return complete;
}

TEST(InertialQueue, GivesEachFrameItsSamples) {
  InertialQueue queue;
  EXPECT_EQ(complete_frames(0.0, 300, {}, queue), 300);
}

TEST(InertialQueue, LeavesOutSamplesWithAWrongTime) {
  for (const double error : {3.0, -3.0, 1e6, -1e6, 0.5, -0.5}) {
    InertialQueue queue;
    EXPECT_GE(complete_frames(1000.0, 300, {{1000, error}, {2000, error}}, queue), 296) << error;
  }
}

TEST(InertialQueue, KeepsSamplesAfterARestartForTheFramesAfterIt) {
  InertialQueue queue;
  for (int i = 0; i < 10; ++i) queue.add(sample_at(1000.0 + 0.0025 * i));
  for (int i = 0; i < 10; ++i) queue.add(sample_at(0.0025 * i));  // read ahead
  EXPECT_EQ(queue.take_until(1000.05, 0).size(), 10U);
  EXPECT_EQ(queue.take_until(1000.08, 0).size(), 0U);
  EXPECT_EQ(queue.take_until(0.05, 1).size(), 10U);
  EXPECT_EQ(complete_frames(1.0, 300, {}, queue, 1), 300);
}

TEST(InertialQueue, FollowsAClockOfItsOwnThatLeaps) {
  InertialQueue queue;
  EXPECT_EQ(complete_frames(1000.0, 30, {}, queue), 30);
  EXPECT_GE(complete_frames(500.0, 30, {}, queue), 29);   // frames go back as well, unseen by their source
  EXPECT_GE(complete_frames(2000.0, 30, {}, queue), 29);  // and forward
}

TEST(InertialQueue, IsBounded) {
  InertialQueue queue;
  for (int i = 0; i < 100000; ++i) queue.add(sample_at(0.0025 * i));
  EXPECT_EQ(queue.take_until(1e9, 0).size(), 4000U);
}

}  // namespace
}  // namespace roslam
