// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/workers/frame_queue.hpp"

#include <gtest/gtest.h>

#include <future>
#include <vector>

namespace roslam {
namespace {

Frame numbered(std::size_t index) {
  Frame frame;
  frame.index = index;
  return frame;
}

void push(FrameQueue& queue, std::size_t first, std::size_t count) {
  for (std::size_t i = first; i < first + count; ++i) queue.push(numbered(i));
}

std::vector<std::size_t> rest(FrameQueue& queue) {
  std::vector<std::size_t> indices;
  queue.close();
  while (const auto frame = queue.pop()) indices.push_back(frame->index);
  return indices;
}

TEST(FrameQueue, DropsNothingWhileFewWait) {
  FrameQueue queue(2);
  for (std::size_t i = 0; i < 50; i += 2) {
    push(queue, i, 2);
    EXPECT_EQ(queue.pop()->index, i);
    EXPECT_EQ(queue.pop()->index, i + 1);
  }
  EXPECT_EQ(queue.dropped(), 0U);
  EXPECT_EQ(queue.longest_gap(), 0U);
}

TEST(FrameQueue, PassesOverOneFrameAtATimeWhenMoreWait) {
  FrameQueue queue(2);
  push(queue, 0, 6);
  EXPECT_EQ(queue.pop()->index, 1U);  // 0 is passed over: 6 waited
  EXPECT_EQ(queue.pop()->index, 3U);  // 4 waited
  EXPECT_EQ(queue.pop()->index, 4U);  // 2 wait, which may
  EXPECT_EQ(queue.pop()->index, 5U);
  EXPECT_EQ(queue.dropped(), 2U);
  EXPECT_EQ(queue.longest_gap(), 1U);
}

TEST(FrameQueue, KeepsEverySecondFrameOfAStallThatFillsIt) {
  FrameQueue queue(2);
  push(queue, 0, 9);  // eight have room
  EXPECT_EQ(queue.dropped(), 4U);
  EXPECT_EQ(rest(queue), (std::vector<std::size_t>{0, 2, 4, 6, 8}));
  EXPECT_EQ(queue.longest_gap(), 1U);
}

TEST(FrameQueue, StaysBoundedHoweverLongTheStallAndCountsEveryFrame) {
  FrameQueue queue(2);
  push(queue, 0, 1000);
  const auto kept = rest(queue);
  EXPECT_LE(kept.size(), 8U);
  EXPECT_EQ(kept.back(), 999U);
  EXPECT_EQ(kept.size() + queue.dropped(), 1000U);
}

// A tracker that takes 1.3 times as long as the camera.
TEST(FrameQueue, NeverDropsTwoInARowOfASteadyOverload) {
  FrameQueue queue(2);
  double tracked_until = 0.0;
  std::size_t handed_out = 0;
  for (std::size_t i = 0; i < 3000; ++i) {
    queue.push(numbered(i));
    for (; tracked_until <= static_cast<double>(i); tracked_until += 1.3, ++handed_out) queue.pop();
  }
  EXPECT_EQ(queue.longest_gap(), 1U);
  EXPECT_NEAR(static_cast<double>(queue.dropped()), 3000.0 * (1.0 - 1.0 / 1.3), 5.0);
}

TEST(FrameQueue, HandsTheInertialSamplesOfDroppedFramesToTheNext) {
  FrameQueue queue(2);
  std::size_t seen = 0;
  const auto take = [&] {
    const auto frame = queue.pop();
    ASSERT_TRUE(frame);
    for (const InertialSample& sample : frame->inertial)
      EXPECT_EQ(sample.timestamp, static_cast<double>(seen++));  // all, each once, in order
    EXPECT_EQ(seen, frame->index + 1);
  };
  for (std::size_t i = 0; i < 100; ++i) {
    Frame frame = numbered(i);
    frame.inertial.push_back({static_cast<double>(i)});
    queue.push(std::move(frame));
    if (i % 40 > 30) take();
  }
  queue.close();
  while (seen < 100) take();
  EXPECT_GT(queue.dropped(), 20U);
}

TEST(FrameQueue, GivesTheNewestWhereTheLatencyMatters) {
  FrameQueue queue(2, FrameQueue::Policy::kNewest);
  for (std::size_t i = 0; i < 5; ++i) {
    Frame frame = numbered(i);
    frame.inertial.push_back({static_cast<double>(i)});
    queue.push(std::move(frame));
  }
  const auto frame = queue.pop();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->index, 4U);
  EXPECT_EQ(frame->inertial.size(), 5U) << "those of dropped frames as well";
  EXPECT_EQ(queue.dropped(), 4U);
  EXPECT_EQ(queue.longest_gap(), 4U);
}

TEST(FrameQueue, EndsWithAllThatWaitsOrWithNothing) {
  FrameQueue closed(2);
  push(closed, 0, 5);
  EXPECT_EQ(rest(closed), (std::vector<std::size_t>{0, 1, 2, 3, 4}));  // no more come: no hurry
  closed.push(numbered(9));
  EXPECT_FALSE(closed.pop());
  FrameQueue discarded(2);
  push(discarded, 0, 2);
  auto waiting = std::async(std::launch::async, [&] {
    std::size_t frames = 0;
    while (discarded.pop()) ++frames;
    return frames;
  });
  discarded.discard();
  EXPECT_LE(waiting.get(), 2U);
}

}  // namespace
}  // namespace roslam
