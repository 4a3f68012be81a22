// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/workers/load_control.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

namespace roslam {
namespace {

constexpr double kFps = 30.0;

void note(LoadControl& load, int frames, double share_of_budget) {
  for (int i = 0; i < frames; ++i) load.note_frame(share_of_budget / kFps);
}

TEST(LoadControl, TakesNoMeasureWhileThereIsTime) {
  LoadControl load(Mode::kRealTime, kFps);
  note(load, 1000, 0.8);
  EXPECT_FALSE(load.is_taken(LoadMeasure::kRestorationWaits));
  EXPECT_TRUE(load.frames().empty());
  load.wait_while(LoadMeasure::kRestorationWaits);  // returns at once
}

TEST(LoadControl, TakesOneMeasureAfterTheOtherAndGivesThemBack) {
  LoadControl load(Mode::kRealTime, kFps);
  note(load, 20, 1.1);
  EXPECT_TRUE(load.is_taken(LoadMeasure::kRestorationWaits));
  EXPECT_FALSE(load.is_taken(LoadMeasure::kLabelsEverySecond));
  note(load, 60, 1.1);
  EXPECT_TRUE(load.is_taken(LoadMeasure::kLabelsEverySecond));
  note(load, 1000, 0.3);
  EXPECT_FALSE(load.is_taken(LoadMeasure::kRestorationWaits));
  const auto frames = load.frames();
  EXPECT_EQ(frames.size(), 4U);
  EXPECT_GT(frames.at("restoration waits"), frames.at("labels of every second frame"));
}

TEST(LoadControl, IsNotMovedByOneLongFrame) {
  LoadControl load(Mode::kRealTime, kFps);
  note(load, 100, 0.5);
  load.note_frame(2.0);  // seconds, as a relocalisation
  EXPECT_FALSE(load.is_taken(LoadMeasure::kRestorationWaits));
}

TEST(LoadControl, DoesNothingInDeterministicModeOrWithoutAFrameRate) {
  LoadControl deterministic(Mode::kDeterministic, kFps);
  LoadControl unknown(Mode::kRealTime, 0.0);
  for (LoadControl* load : {&deterministic, &unknown}) {
    note(*load, 100, 5.0);
    EXPECT_FALSE(load->is_taken(LoadMeasure::kRestorationWaits));
  }
}

TEST(LoadControl, WaitersGoOnWhenTheLoadFallsOrTheRunEnds) {
  for (const bool by_release : {false, true}) {
    LoadControl load(Mode::kRealTime, kFps);
    note(load, 100, 2.0);
    std::atomic<bool> has_waited = false;
    std::jthread waiter([&] {
      load.wait_while(LoadMeasure::kDenseMapWaits);
      has_waited = true;
    });
    EXPECT_FALSE(has_waited);
    by_release ? load.release() : note(load, 1000, 0.1);
    waiter.join();
    EXPECT_TRUE(has_waited);
    load.wait_while(LoadMeasure::kDenseMapWaits);  // and never again after the release
  }
}

}  // namespace
}  // namespace roslam
