// SPDX-License-Identifier: BSD-3-Clause
// The queues between threads: what is lost when they are full is the oldest, and it is counted.
#include "roslam/common/bounded_queue.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/slam/keyframe_jobs.hpp"

namespace roslam {
namespace {

constexpr std::chrono::seconds kLimit{30};

// The elements of a closed queue.
template <typename T>
std::vector<T> rest_of(BoundedQueue<T>& queue) {
  std::vector<T> elements;
  while (auto element = queue.pop()) elements.push_back(std::move(*element));
  return elements;
}

TEST(BoundedQueue, GivesElementsInTheOrderTheyCame) {
  BoundedQueue<int> queue(3);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(queue.push(i), 0U);
  EXPECT_EQ(queue.pop(), 0);
  EXPECT_EQ(queue.push(3), 0U);
  for (int i = 1; i < 4; ++i) EXPECT_EQ(queue.pop(), i);
}

TEST(BoundedQueue, ANewElementTakesThePlaceOfTheOldest) {
  BoundedQueue<int> queue(3);
  std::size_t lost = 0;
  for (int i = 0; i < 10; ++i) {
    const std::size_t dropped = queue.push(i);
    EXPECT_EQ(dropped, i < 3 ? 0U : 1U) << i;
    lost += dropped;
  }
  EXPECT_EQ(lost, 7U);
  queue.close();
  EXPECT_EQ(rest_of(queue), (std::vector<int>{7, 8, 9}));
}

TEST(BoundedQueue, OfCapacityOneHoldsTheNewest) {
  BoundedQueue<int> queue(1);
  EXPECT_EQ(queue.push(1), 0U);
  EXPECT_EQ(queue.push(2), 1U);
  EXPECT_EQ(queue.pop(), 2);
}

TEST(BoundedQueue, HoldsElementsThatCannotBeCopied) {
  BoundedQueue<std::unique_ptr<int>> queue(2);
  queue.push(std::make_unique<int>(5));
  const auto element = queue.pop();
  ASSERT_TRUE(element.has_value());
  EXPECT_EQ(**element, 5);
}

TEST(BoundedQueue, PopWaitsForAnElement) {
  BoundedQueue<int> queue(2);
  auto popped = std::async(std::launch::async, [&] { return queue.pop(); });
  EXPECT_EQ(popped.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  EXPECT_EQ(queue.push(4), 0U);
  ASSERT_EQ(popped.wait_for(kLimit), std::future_status::ready);
  EXPECT_EQ(popped.get(), 4);
}

TEST(BoundedQueue, ElementsCanBeTakenAfterItWasClosed) {
  BoundedQueue<int> queue(3);
  queue.push(1);
  queue.push(2);
  queue.close();
  EXPECT_EQ(queue.pop(), 1);
  EXPECT_EQ(queue.pop(), 2);
  EXPECT_EQ(queue.pop(), std::nullopt);
  EXPECT_EQ(queue.pop(), std::nullopt);
}

TEST(BoundedQueue, DiscardedElementsCannotBeTaken) {
  BoundedQueue<int> queue(3);
  queue.push(1);
  queue.push(2);
  queue.discard();
  EXPECT_EQ(queue.pop(), std::nullopt);
}

TEST(BoundedQueue, AnElementPushedAfterTheEndIsCountedAsLost) {
  BoundedQueue<int> closed(3);
  closed.push(1);
  closed.close();
  EXPECT_EQ(closed.push(2), 1U);
  EXPECT_EQ(rest_of(closed), std::vector<int>{1});
  BoundedQueue<int> discarded(3);
  discarded.discard();
  EXPECT_EQ(discarded.push(2), 1U);
  EXPECT_EQ(discarded.pop(), std::nullopt);
}

TEST(BoundedQueue, ClosingAndDiscardingEndAPopThatWaits) {
  for (const bool closes : {true, false}) {
    BoundedQueue<int> queue(2);
    std::vector<std::future<std::optional<int>>> popped;
    for (int i = 0; i < 2; ++i) popped.push_back(std::async(std::launch::async, [&] { return queue.pop(); }));
    EXPECT_EQ(popped.front().wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
    closes ? queue.close() : queue.discard();
    for (auto& result : popped) {
      ASSERT_EQ(result.wait_for(kLimit), std::future_status::ready);
      EXPECT_EQ(result.get(), std::nullopt);
    }
  }
}

TEST(BoundedQueue, AccountsForEveryElementBetweenTwoThreads) {
  constexpr int kElements = 20000;
  for (const std::size_t capacity : {1U, 2U, 50U}) {
    BoundedQueue<int> queue(capacity);
    std::size_t dropped = 0;
    std::jthread writer([&] {
      for (int i = 0; i < kElements; ++i) dropped += queue.push(i);
      queue.close();
    });
    const std::vector<int> taken = rest_of(queue);
    writer.join();
    EXPECT_EQ(taken.size() + dropped, static_cast<std::size_t>(kElements));
    for (std::size_t i = 1; i < taken.size(); ++i) ASSERT_LT(taken[i - 1], taken[i]);
    ASSERT_FALSE(taken.empty());
    EXPECT_EQ(taken.back(), kElements - 1);
  }
}

TEST(KeyframeJobs, GivesTheJobOfAKeyframeOnce) {
  KeyframeJobs<std::string> jobs(3);
  EXPECT_TRUE(jobs.put(KeyframeId{4}, "four").empty());
  EXPECT_TRUE(jobs.put(KeyframeId{7}, "seven").empty());
  EXPECT_EQ(jobs.take(KeyframeId{7}), "seven");
  EXPECT_EQ(jobs.take(KeyframeId{7}), std::nullopt);
  EXPECT_EQ(jobs.take(KeyframeId{5}), std::nullopt);
  EXPECT_EQ(jobs.take(KeyframeId{4}), "four");
  EXPECT_EQ(jobs.dropped(), 0U);
}

TEST(KeyframeJobs, DropsTheOldestAndSaysWhich) {
  KeyframeJobs<int> jobs(2);
  EXPECT_TRUE(jobs.put(KeyframeId{0}, 10).empty());
  EXPECT_TRUE(jobs.put(KeyframeId{1}, 11).empty());
  EXPECT_EQ(jobs.put(KeyframeId{2}, 12), std::vector<KeyframeId>{KeyframeId{0}});
  EXPECT_EQ(jobs.put(KeyframeId{3}, 13), std::vector<KeyframeId>{KeyframeId{1}});
  EXPECT_EQ(jobs.dropped(), 2U);
  EXPECT_EQ(jobs.take(KeyframeId{0}), std::nullopt);
  EXPECT_EQ(jobs.take(KeyframeId{2}), 12);
  EXPECT_TRUE(jobs.put(KeyframeId{4}, 14).empty());  // there is room again
  EXPECT_EQ(jobs.take(KeyframeId{3}), 13);
  EXPECT_EQ(jobs.take(KeyframeId{4}), 14);
  EXPECT_EQ(jobs.dropped(), 2U);
}

TEST(KeyframeJobs, WithoutRoomDropsEachJobAtOnce) {
  KeyframeJobs<int> jobs(0);
  EXPECT_EQ(jobs.put(KeyframeId{3}, 1), std::vector<KeyframeId>{KeyframeId{3}});
  EXPECT_EQ(jobs.take(KeyframeId{3}), std::nullopt);
  EXPECT_EQ(jobs.dropped(), 1U);
}

TEST(KeyframeJobs, CountsFaultsByMessage) {
  KeyframeJobs<int> jobs(1);
  EXPECT_TRUE(jobs.faults().empty());
  jobs.note_fault(InputError("unreadable"));
  jobs.note_fault(ModelError("unreadable"));
  jobs.note_fault(InputError("too small"));
  EXPECT_EQ(jobs.faults(), (std::map<std::string, std::size_t>{{"unreadable", 2}, {"too small", 1}}));
  EXPECT_EQ(jobs.dropped(), 0U);
}

TEST(KeyframeJobs, AccountsForEveryJobBetweenTwoThreads) {
  constexpr std::uint32_t kJobs = 5000;
  KeyframeJobs<std::uint32_t> jobs(4);
  BoundedQueue<KeyframeId> order(kJobs);
  std::vector<KeyframeId> gone;
  std::jthread writer([&] {
    for (std::uint32_t i = 0; i < kJobs; ++i) {
      for (const KeyframeId id : jobs.put(KeyframeId{i}, i)) gone.push_back(id);
      order.push(KeyframeId{i});
    }
    order.close();
  });
  std::vector<KeyframeId> missing;
  while (const auto id = order.pop()) {
    const auto job = jobs.take(*id);
    if (job) {
      EXPECT_EQ(*job, id->value);
    } else {
      missing.push_back(*id);
      jobs.note_fault(InputError("gone"));
    }
  }
  writer.join();
  EXPECT_EQ(missing, gone);
  EXPECT_EQ(jobs.dropped(), gone.size());
  EXPECT_EQ(jobs.faults().empty(), gone.empty());
}

}  // namespace
}  // namespace roslam
