// SPDX-License-Identifier: BSD-3-Clause
// Results while frames are processed: snapshots and callbacks, from other threads.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/map/map_parts.hpp"
#include "roslam/slam/slam.hpp"
#include "roslam/workers/callback_queue.hpp"
#include "tests/street_frames.hpp"

namespace roslam::street {
namespace {

class LiveResults : public Street {
 protected:
  static std::unique_ptr<Slam> slam(Mode mode) {
    Options options;
    options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
    return std::make_unique<Slam>(*camera_preset("simulated"), options, mode);
  }
};

TEST_F(LiveResults, AreReadByOtherThreadsMeanwhile) {
  const auto slam = LiveResults::slam(Mode::kRealTime);
  std::atomic<bool> ends = false;
  std::atomic<int> snapshots = 0, maps = 0;
  const auto read = [&](bool copies) {
    std::size_t frames = 0;
    while (!ends) {
      const auto snapshot = slam->snapshot();
      EXPECT_GE(snapshot->frames, frames);
      EXPECT_LE(snapshot->path.size(), slam->trajectory().size());
      frames = snapshot->frames;
      std::set<KeyframeId> keyframes;
      for (const auto& keyframe : snapshot->keyframes) EXPECT_TRUE(keyframes.insert(keyframe.id).second);
      for (const auto& landmark : snapshot->landmarks) EXPECT_TRUE(landmark.position.allFinite());
      ++snapshots;
      if (!copies) continue;
      const SavedMap saved = slam->saved_map();
      for (const LandmarkId id : saved.map.landmark_ids())
        EXPECT_FALSE(saved.map.find(id)->observations.empty());
      ++maps;
    }
  };
  {
    std::jthread first([&] { read(false); });
    std::jthread second([&] { read(true); });
    for (const auto& frame : *frames_) slam->process(frame);
    slam->finish();
    ends = true;
  }
  EXPECT_GT(snapshots, 5);
  EXPECT_GT(maps, 3);
  const auto last = slam->snapshot();
  std::this_thread::sleep_for(std::chrono::milliseconds(120));
  const auto fresh = slam->snapshot();
  EXPECT_EQ(fresh->keyframes.size(), slam->map().keyframe_count());
  EXPECT_EQ(fresh->landmarks.size(), slam->map().landmark_count());
  EXPECT_EQ(fresh->path.size(), slam->trajectory().size());
  EXPECT_GT(slam->lock_times().longest_held.at("snapshot for readers"), 0.0);
}

TEST_F(LiveResults, AreHandedToCallbacks) {
  for (const Mode mode : {Mode::kDeterministic, Mode::kRealTime}) {
    const auto slam = LiveResults::slam(mode);
    std::vector<double> times;
    std::set<KeyframeId> keyframes;
    slam->on_frame([&](const FrameResult& result) { times.push_back(result.timestamp); });
    slam->on_map_changed([&](const MapChange& change) {
      for (const auto& keyframe : change.moved) keyframes.insert(keyframe.id);
      for (const KeyframeId removed : change.removed) keyframes.erase(removed);
    });
    std::vector<double> expected;
    for (const auto& frame : *frames_) {
      slam->process(frame);
      expected.push_back(frame.timestamp);
    }
    slam->finish();
    EXPECT_EQ(times.size() + slam->dropped_callbacks(), expected.size());
    if (slam->dropped_callbacks() > 0) continue;  // a machine that is busy with other things
    EXPECT_EQ(times, expected);
    const auto ids = slam->map().keyframe_ids();
    EXPECT_EQ(keyframes, std::set<KeyframeId>(ids.begin(), ids.end()));
  }
}

TEST_F(LiveResults, WhatACallbackThrowsIsCounted) {
  for (const Mode mode : {Mode::kDeterministic, Mode::kRealTime}) {
    const auto slam = LiveResults::slam(mode);
    slam->on_frame([](const FrameResult&) { throw std::runtime_error("lost my mind"); });
    for (std::size_t i = 0; i < 10; ++i) EXPECT_TRUE(slam->process((*frames_)[i]).T_world_camera);
    slam->finish();
    EXPECT_EQ(slam->callback_faults().at("lost my mind"), 10U);
  }
}

TEST_F(LiveResults, ACallbackThatBlocksCostsTheTrackerNothing) {
  const auto slam = LiveResults::slam(Mode::kRealTime);
  std::atomic<int> calls = 0;
  slam->on_frame([&](const FrameResult&) {
    ++calls;
    std::this_thread::sleep_for(std::chrono::seconds(1));
  });
  for (std::size_t i = 0; i < 20; ++i) EXPECT_LT(slam->process((*frames_)[i]).latency, 0.9) << i;
  const auto begun = std::chrono::steady_clock::now();
  slam->finish();
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(5)) << "not for each of 20 frames";
  EXPECT_LT(calls, 20);
}

TEST_F(LiveResults, ACallbackMayReadButNotFeed) {
  for (const Mode mode : {Mode::kDeterministic, Mode::kRealTime}) {
    const auto slam = LiveResults::slam(mode);
    std::atomic<int> read = 0;
    slam->on_frame([&](const FrameResult&) {
      if (slam->snapshot() && slam->saved_map().map.keyframe_count() > 0 && !slam->trajectory().empty())
        ++read;
      slam->process((*frames_)[0]);
    });
    slam->on_map_changed([&](const MapChange&) {
      slam->snapshot();
      slam->finish();
    });
    for (std::size_t i = 0; i < 10; ++i) slam->process((*frames_)[i]);
    slam->finish();
    EXPECT_EQ(read, 10);
    const auto faults = slam->callback_faults();
    EXPECT_EQ(faults.at("Slam::process must not be called by a callback"), 10U);
    EXPECT_GE(faults.at("Slam::finish must not be called by a callback"), 1U);
    EXPECT_EQ(slam->frames(), 10U);
  }
}

TEST(CallbackQueue, DropsTheOldestOfTooManyAndEndsAtOnce) {
  std::vector<int> calls;
  std::atomic<bool> may_go = false, is_blocked = false;
  {
    CallbackQueue queue(Mode::kRealTime);
    queue.post([&] {
      is_blocked = true;
      while (!may_go) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    });
    while (!is_blocked) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    for (int i = 0; i < 200; ++i) queue.post([&, i] { calls.push_back(i); });
    may_go = true;
    queue.drain();
    EXPECT_GE(queue.dropped(), 200U - 65U);
    EXPECT_EQ(calls.size() + queue.dropped(), 200U);
    EXPECT_EQ(calls.back(), 199);
    may_go = false;
    queue.post([&] {
      while (!may_go) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    });
    queue.post([&] { calls.push_back(-1); });
    queue.cancel();
    may_go = true;
  }
  EXPECT_EQ(calls.back(), 199) << "what waits is discarded";
}

// Copies of a map that another thread changes fit together, whatever they catch.
TEST(MapParts, OfAMapInUseFitTogether) {
  Map map({1.0F, 1.2F});
  MapMutex mutex;
  auto view = std::make_shared<ObservedFrame>();
  constexpr std::uint32_t kPoints = 50;
  view->pixels.assign(kPoints, {100.0F, 100.0F});
  view->depths.assign(kPoints, 2.0F);
  view->levels.assign(kPoints, 0);
  view->angles.assign(kPoints, 0.0F);
  view->colours.assign(kPoints, {});
  view->descriptors.assign(kPoints, {});
  std::atomic<bool> ends = false;
  std::jthread changes([&] {
    std::vector<KeyframeId> ids;
    for (std::uint32_t i = 0; !ends; ++i) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      const MapLock lock(mutex, "test");
      ids.push_back(map.add_keyframe(i, i, SE3(), view));
      for (std::uint32_t k = 0; k < kPoints; ++k) {
        const LandmarkId id = map.add_landmark({0, 0, 2}, ids.back(), k);
        if (ids.size() > 1 && k % 2 == 0 && map.find(ids[ids.size() - 2]) != nullptr) {
          const LandmarkId earlier = map.find(ids[ids.size() - 2])->landmarks[k];
          if (map.find(earlier) != nullptr) map.merge_landmarks(earlier, id);
        }
      }
      if (ids.size() > 5 && i % 3 == 0) map.remove_keyframe(ids[ids.size() - 4], ids.back());
      if (ids.size() > 5 && i % 3 == 0) ids.erase(ids.end() - 4);
    }
  });
  std::size_t keyframes = 0;
  for (int i = 0; i < 50; ++i) {
    Map copy({1.0F, 1.2F});
    copy.append(MapParts::of(map, mutex));
    for (const LandmarkId id : copy.landmark_ids()) {
      for (const auto& [keyframe, point] : copy.find(id)->observations) {
        ASSERT_NE(copy.find(keyframe), nullptr);
        ASSERT_EQ(copy.find(keyframe)->landmarks[point], id);
      }
    }
    keyframes = copy.keyframe_count();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ends = true;
  EXPECT_GT(keyframes, 10U);
}

}  // namespace
}  // namespace roslam::street
