// SPDX-License-Identifier: BSD-3-Clause
// The thread that mapping and loop closing run on: order, failures and cancelling.
#include "roslam/workers/keyframe_worker.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "roslam/common/error.hpp"

namespace roslam {
namespace {

using Clock = std::chrono::steady_clock;
using OnFailure = KeyframeWorker::OnFailure;
using Faults = std::map<std::string, std::size_t>;

// A test fails rather than waits for ever.
constexpr std::chrono::seconds kLimit{30};
constexpr int kNever = 1000;  // keyframes; more than any test lets wait

std::vector<KeyframeId> ids(std::uint32_t from, std::uint32_t end) {
  std::vector<KeyframeId> result;
  for (std::uint32_t i = from; i < end; ++i) result.push_back(KeyframeId{i});
  return result;
}

// Keyframes that the work was called for.
class Seen {
 public:
  void add(KeyframeId id) {
    const std::scoped_lock lock(mutex_);
    ids_.push_back(id);
    changed_.notify_all();
  }
  bool wait_for(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kLimit, [&] { return ids_.size() >= count; });
  }
  std::vector<KeyframeId> all() const {
    const std::scoped_lock lock(mutex_);
    return ids_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<KeyframeId> ids_;
};

// Holds the work until the test opens it.
class Gate {
 public:
  void pass() {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, kLimit, [&] { return is_open_; });
  }
  void open() {
    const std::scoped_lock lock(mutex_);
    is_open_ = true;
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_open_ = false;
};

// An optimisation that takes 20 s, unless it is asked to stop. Returns whether it was.
bool iterate(const KeyframeWorker::ShouldStop& should_stop) {
  const auto end = Clock::now() + std::chrono::seconds(20);
  while (!should_stop() && Clock::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return Clock::now() < end;
}

// A job that goes on until it is told to stop; has_stopped: whether it was.
KeyframeWorker::Work long_work(Seen& seen, bool& has_stopped) {
  return [&](KeyframeId id, const auto& should_stop, StageTimes&) {
    seen.add(id);
    has_stopped = iterate(should_stop);
  };
}

template <typename Call>
std::string message_thrown_by(Call&& call) {
  try {
    call();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "nothing was thrown";
}

class KeyframeWorkerInBothModes : public testing::TestWithParam<Mode> {};

INSTANTIATE_TEST_SUITE_P(Modes, KeyframeWorkerInBothModes,
                         testing::Values(Mode::kDeterministic, Mode::kRealTime), [](const auto& tested) {
                           return tested.param == Mode::kRealTime ? "RealTime" : "Deterministic";
                         });

TEST_P(KeyframeWorkerInBothModes, ProcessesEachKeyframeOnceInTheOrderOfSubmission) {
  Seen seen;
  KeyframeWorker worker([&](KeyframeId id, const auto&, StageTimes&) { seen.add(id); }, GetParam(), 1);
  EXPECT_TRUE(worker.is_idle());
  for (const KeyframeId id : ids(0, 200)) worker.submit(id);
  worker.drain();
  EXPECT_EQ(seen.all(), ids(0, 200));
  EXPECT_EQ(worker.waiting(), 0U);
  EXPECT_TRUE(worker.is_idle());
  EXPECT_TRUE(worker.faults().empty());
}

TEST_P(KeyframeWorkerInBothModes, DrainDoesNotWaitWhereNothingWasSubmitted) {
  KeyframeWorker worker([](KeyframeId, const auto&, StageTimes&) {}, GetParam(), 1);
  worker.drain();
  worker.check();
  EXPECT_TRUE(worker.times().summary().empty());
}

TEST_P(KeyframeWorkerInBothModes, AddsUpTheTimesOfTheSteps) {
  KeyframeWorker worker(
      [](KeyframeId id, const auto&, StageTimes& times) {
        times.add("first", 0.001 * (id.value + 1));
        if (id.value == 2) times.add("second", 0.5);
      },
      GetParam(), 1);
  for (const KeyframeId id : ids(0, 4)) worker.submit(id);
  worker.drain();
  const auto times = worker.times().summary();
  ASSERT_EQ(times.size(), 2U);
  EXPECT_EQ(times.at("first").count, 4U);
  EXPECT_NEAR(times.at("first").mean_ms, 2.5, 1e-9);
  EXPECT_NEAR(times.at("first").max_ms, 4.0, 1e-9);
  EXPECT_EQ(times.at("second").count, 1U);
  EXPECT_NEAR(times.at("second").mean_ms, 500.0, 1e-9);
}

TEST_P(KeyframeWorkerInBothModes, CountsAFailureOnceAndIgnoresLaterKeyframesIfItSwitchesOff) {
  Seen seen;
  KeyframeWorker worker(
      [&](KeyframeId id, const auto&, StageTimes&) {
        seen.add(id);
        if (id.value >= 2) throw InputError("no more loops");
      },
      GetParam(), 1, OnFailure::kSwitchOff);
  worker.submit(KeyframeId{0});
  worker.submit(KeyframeId{1});
  worker.drain();
  EXPECT_TRUE(worker.faults().empty());
  EXPECT_NO_THROW(worker.submit(KeyframeId{2}));
  EXPECT_NO_THROW(worker.drain());
  EXPECT_EQ(worker.faults(), (Faults{{"no more loops", 1}}));
  EXPECT_NO_THROW(worker.submit(KeyframeId{3}));
  EXPECT_NO_THROW(worker.check());
  EXPECT_NO_THROW(worker.drain());
  EXPECT_EQ(worker.faults(), (Faults{{"no more loops", 1}}));
  EXPECT_EQ(seen.all(), ids(0, 3));
  EXPECT_EQ(worker.waiting(), 0U);
  EXPECT_TRUE(worker.is_idle());
}

TEST_P(KeyframeWorkerInBothModes, CountsAnExceptionWithoutAMessageAsUnknown) {
  KeyframeWorker worker([](KeyframeId, const auto&, StageTimes&) { throw 7; }, GetParam(), 1,
                        OnFailure::kSwitchOff);
  EXPECT_NO_THROW(worker.submit(KeyframeId{0}));
  EXPECT_NO_THROW(worker.drain());
  EXPECT_EQ(worker.faults(), (Faults{{"unknown", 1}}));
}

TEST_P(KeyframeWorkerInBothModes, IgnoresKeyframesAfterItWasCancelled) {
  Seen seen;
  KeyframeWorker worker([&](KeyframeId id, const auto&, StageTimes&) { seen.add(id); }, GetParam(), 1);
  worker.submit(KeyframeId{0});
  worker.drain();
  EXPECT_FALSE(worker.is_cancelled());
  worker.cancel();
  EXPECT_TRUE(worker.is_cancelled());
  worker.submit(KeyframeId{1});
  worker.drain();
  EXPECT_EQ(seen.all(), ids(0, 1));
  EXPECT_EQ(worker.waiting(), 0U);
}

TEST(KeyframeWorkerDeterministic, WorksOnTheThreadOfTheCallerBeforeSubmitReturns) {
  std::thread::id thread;
  KeyframeWorker worker([&](KeyframeId, const auto&, StageTimes&) { thread = std::this_thread::get_id(); },
                        Mode::kDeterministic, 1);
  worker.submit(KeyframeId{0});
  EXPECT_EQ(thread, std::this_thread::get_id());
}

TEST(KeyframeWorkerDeterministic, SubmitThrowsWhatTheWorkThrew) {
  KeyframeWorker worker([](KeyframeId, const auto&, StageTimes&) { throw InputError("a bad keyframe"); },
                        Mode::kDeterministic, 1);
  EXPECT_EQ(message_thrown_by([&] { worker.submit(KeyframeId{0}); }), "a bad keyframe");
  EXPECT_EQ(worker.waiting(), 0U);
  EXPECT_TRUE(worker.faults().empty());
}

// With 0 keyframes the condition holds at once in real-time mode, which is the control.
TEST(KeyframeWorkerDeterministic, NeverAsksTheWorkToStopForKeyframesThatWait) {
  for (const Mode mode : {Mode::kDeterministic, Mode::kRealTime}) {
    std::optional<bool> is_asked_to_stop;
    KeyframeWorker worker(
        [&](KeyframeId, const auto& should_stop, StageTimes&) { is_asked_to_stop = should_stop(); }, mode, 0);
    worker.submit(KeyframeId{0});
    worker.drain();
    EXPECT_EQ(is_asked_to_stop, mode == Mode::kRealTime);
  }
}

TEST(KeyframeWorkerDeterministic, CancellingFromAnotherThreadEndsTheJobInProgress) {
  Seen seen;
  bool has_stopped = false;
  KeyframeWorker worker(
      [&](KeyframeId id, const auto& should_stop, StageTimes&) {
        EXPECT_FALSE(should_stop());
        seen.add(id);
        has_stopped = iterate(should_stop);
      },
      Mode::kDeterministic, kNever);
  auto canceller = std::async(std::launch::async, [&] {
    const bool has_begun = seen.wait_for(1);
    worker.cancel();
    return has_begun;
  });
  worker.submit(KeyframeId{0});
  EXPECT_TRUE(canceller.get());
  EXPECT_TRUE(has_stopped);
  worker.submit(KeyframeId{1});
  EXPECT_EQ(seen.all(), ids(0, 1));
}

TEST(KeyframeWorkerRealTime, WorksOnAThreadOfItsOwnAndCountsKeyframesThatWait) {
  Seen seen;
  Gate gate;
  std::thread::id thread;
  KeyframeWorker worker(
      [&](KeyframeId id, const auto&, StageTimes&) {
        thread = std::this_thread::get_id();
        seen.add(id);
        gate.pass();
      },
      Mode::kRealTime, kNever);
  worker.submit(KeyframeId{0});  // returns although the work does not
  ASSERT_TRUE(seen.wait_for(1));
  EXPECT_EQ(worker.waiting(), 0U);
  EXPECT_FALSE(worker.is_idle());
  worker.submit(KeyframeId{1});
  worker.submit(KeyframeId{2});
  EXPECT_EQ(worker.waiting(), 2U);
  auto drained = std::async(std::launch::async, [&] { worker.drain(); });
  EXPECT_EQ(drained.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  gate.open();
  ASSERT_EQ(drained.wait_for(kLimit), std::future_status::ready);
  EXPECT_EQ(seen.all(), ids(0, 3));
  EXPECT_EQ(worker.waiting(), 0U);
  EXPECT_TRUE(worker.is_idle());
  EXPECT_NE(thread, std::this_thread::get_id());
}

// The tracker submits nothing while the queue is full, so it would not learn of the failure if the queue
// stayed full.
TEST(KeyframeWorkerRealTime, AFailureEmptiesAFullQueueAndIsThrownByEveryCallAfterIt) {
  Seen seen;
  {
    Gate gate;
    KeyframeWorker worker(
        [&](KeyframeId id, const auto&, StageTimes&) {
          seen.add(id);
          gate.pass();
          throw InputError("the map is damaged");
        },
        Mode::kRealTime, kNever);
    worker.submit(KeyframeId{0});
    ASSERT_TRUE(seen.wait_for(1));
    for (const KeyframeId id : ids(1, 4)) worker.submit(id);
    EXPECT_EQ(worker.waiting(), 3U);
    EXPECT_NO_THROW(worker.check());
    gate.open();
    EXPECT_EQ(message_thrown_by([&] { worker.drain(); }), "the map is damaged");
    EXPECT_EQ(worker.waiting(), 0U);
    for (int call = 0; call < 2; ++call) {
      EXPECT_THROW(worker.check(), InputError);
      EXPECT_THROW(worker.submit(KeyframeId{9}), InputError);
      EXPECT_THROW(worker.drain(), InputError);
    }
    EXPECT_EQ(message_thrown_by([&] { worker.check(); }), "the map is damaged");
    EXPECT_EQ(message_thrown_by([&] { worker.submit(KeyframeId{9}); }), "the map is damaged");
    EXPECT_EQ(worker.waiting(), 0U);
    EXPECT_TRUE(worker.faults().empty());
  }
  EXPECT_EQ(seen.all(), ids(0, 1));
}

TEST(KeyframeWorkerRealTime, CheckThrowsWithoutAnotherCallOnceTheWorkHasFailed) {
  KeyframeWorker worker([](KeyframeId, const auto&, StageTimes&) { throw InputError("damaged"); },
                        Mode::kRealTime, 1);
  worker.submit(KeyframeId{0});
  const auto end = Clock::now() + kLimit;
  std::string message;
  while (message.empty() && Clock::now() < end) {
    try {
      worker.check();
      std::this_thread::yield();
    } catch (const InputError& error) {
      message = error.what();
    }
  }
  EXPECT_EQ(message, "damaged");
}

TEST(KeyframeWorkerRealTime, SwitchingOffDiscardsAFullQueue) {
  Seen seen;
  Gate gate;
  KeyframeWorker worker(
      [&](KeyframeId id, const auto&, StageTimes&) {
        seen.add(id);
        gate.pass();
        throw InputError("no more loops");
      },
      Mode::kRealTime, kNever, OnFailure::kSwitchOff);
  worker.submit(KeyframeId{0});
  ASSERT_TRUE(seen.wait_for(1));
  for (const KeyframeId id : ids(1, 4)) worker.submit(id);
  gate.open();
  EXPECT_NO_THROW(worker.drain());
  EXPECT_EQ(worker.waiting(), 0U);
  EXPECT_EQ(worker.faults(), (Faults{{"no more loops", 1}}));
  EXPECT_EQ(seen.all(), ids(0, 1));
}

TEST(KeyframeWorkerRealTime, CancellingEndsALongJobAndDiscardsTheQueueWithinASecond) {
  Seen seen;
  bool has_stopped = false;
  KeyframeWorker worker(long_work(seen, has_stopped), Mode::kRealTime, kNever);
  for (const KeyframeId id : ids(0, 4)) worker.submit(id);
  ASSERT_TRUE(seen.wait_for(1));
  EXPECT_EQ(worker.waiting(), 3U);
  const auto start = Clock::now();
  worker.cancel();
  EXPECT_EQ(worker.waiting(), 0U);
  worker.drain();
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(1));
  EXPECT_TRUE(has_stopped);
  EXPECT_EQ(seen.all(), ids(0, 1));
  EXPECT_TRUE(worker.is_idle());
}

TEST(KeyframeWorkerRealTime, DrainWaitsForTheJobInProgressAlthoughItWasCancelled) {
  Seen seen;
  Gate gate;
  KeyframeWorker worker(
      [&](KeyframeId id, const auto&, StageTimes& times) {
        seen.add(id);
        gate.pass();
        times.add("step", 1.0);
      },
      Mode::kRealTime, kNever);
  worker.submit(KeyframeId{0});
  ASSERT_TRUE(seen.wait_for(1));
  worker.submit(KeyframeId{1});
  worker.cancel();
  auto drained = std::async(std::launch::async, [&] { worker.drain(); });
  EXPECT_EQ(drained.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
  gate.open();
  ASSERT_EQ(drained.wait_for(kLimit), std::future_status::ready);
  EXPECT_EQ(worker.times().summary().at("step").count, 1U);
  EXPECT_EQ(seen.all(), ids(0, 1));
}

TEST(KeyframeWorkerRealTime, TheDestructorDiscardsAFullQueue) {
  Seen seen;
  bool has_stopped = false;
  auto start = Clock::now();
  {
    KeyframeWorker worker(long_work(seen, has_stopped), Mode::kRealTime, kNever);
    for (const KeyframeId id : ids(0, 6)) worker.submit(id);
    ASSERT_TRUE(seen.wait_for(1));
    EXPECT_EQ(worker.waiting(), 5U);
    start = Clock::now();
  }
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(1));
  EXPECT_TRUE(has_stopped);
  EXPECT_EQ(seen.all(), ids(0, 1));
}

TEST(KeyframeWorkerRealTime, AsksTheWorkToStopWhenEnoughKeyframesWait) {
  Seen seen;
  Gate gate;
  std::promise<KeyframeWorker::ShouldStop> given;
  KeyframeWorker worker(
      [&](KeyframeId id, const auto& should_stop, StageTimes&) {
        seen.add(id);
        if (id.value == 0) given.set_value(should_stop);
        gate.pass();
      },
      Mode::kRealTime, 3);
  worker.submit(KeyframeId{0});
  ASSERT_TRUE(seen.wait_for(1));
  const auto should_stop = given.get_future().get();
  EXPECT_FALSE(should_stop());
  worker.submit(KeyframeId{1});
  worker.submit(KeyframeId{2});
  EXPECT_FALSE(should_stop());
  worker.submit(KeyframeId{3});
  EXPECT_TRUE(should_stop());
  gate.open();
  worker.drain();
  EXPECT_FALSE(should_stop());
  EXPECT_EQ(seen.all(), ids(0, 4));
}

TEST(KeyframeWorkerRealTime, MayBeUsedFromSeveralThreads) {
  constexpr std::uint32_t kThreads = 4;
  constexpr std::uint32_t kEach = 200;
  Seen seen;
  KeyframeWorker worker(
      [&](KeyframeId id, const auto&, StageTimes& times) {
        seen.add(id);
        times.add("step", 0.0);
      },
      Mode::kRealTime, 1);
  {
    std::vector<std::jthread> threads;
    for (std::uint32_t thread = 0; thread < kThreads; ++thread) {
      threads.emplace_back([&, thread] {
        for (std::uint32_t i = 0; i < kEach; ++i) {
          worker.submit(KeyframeId{thread * kEach + i});
          worker.check();
          if (i % 50 == 0) {
            EXPECT_LE(worker.times().summary().size(), 1U);
            EXPECT_LE(worker.waiting(), kThreads * kEach);
            EXPECT_FALSE(worker.is_cancelled());
          }
        }
        worker.drain();
      });
    }
  }
  auto all = seen.all();
  std::vector<std::uint32_t> next(kThreads, 0);
  for (const KeyframeId id : all) EXPECT_EQ(id.value % kEach, next.at(id.value / kEach)++);
  EXPECT_EQ(all.size(), kThreads * kEach);
  EXPECT_EQ(worker.times().summary().at("step").count, kThreads * kEach);
}

}  // namespace
}  // namespace roslam
