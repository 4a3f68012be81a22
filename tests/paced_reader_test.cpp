// SPDX-License-Identifier: BSD-3-Clause
// Recorded frames come as a camera would give them, and an end, an error or a stop never leaves anyone
// waiting.
#include "roslam/workers/paced_reader.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <condition_variable>
#include <future>
#include <limits>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "roslam/common/error.hpp"

namespace roslam {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

// A test fails rather than waits for ever.
constexpr std::chrono::seconds kLimit{60};

// What the source does after its last frame.
enum class End { kNothing, kThrow, kStall, kStallAndThrow };

class FakeSource : public FrameSource {
 public:
  explicit FakeSource(std::vector<double> timestamps, End end = End::kNothing)
      : timestamps_(std::move(timestamps)), end_(end) {}

  std::optional<Frame> next() override {
    if (opening != Clock::duration::zero()) std::this_thread::sleep_for(std::exchange(opening, {}));
    std::unique_lock lock(mutex_);
    if (given_ < timestamps_.size()) {
      if (given_ == 0) first_given_ = Clock::now();
      Frame frame;
      frame.index = given_;
      frame.timestamp = timestamps_[given_++];
      changed_.notify_all();
      return frame;
    }
    is_at_end_ = true;
    changed_.notify_all();
    if (end_ == End::kStall || end_ == End::kStallAndThrow)
      changed_.wait_for(lock, kLimit, [&] { return is_interrupted_; });
    if (end_ == End::kThrow || end_ == End::kStallAndThrow) throw InputError("the camera is gone");
    return std::nullopt;
  }

  void interrupt() override {
    const std::scoped_lock lock(mutex_);
    is_interrupted_ = true;
    changed_.notify_all();
  }

  const Camera& camera() const override { return camera_; }
  bool is_live() const override { return is_a_camera; }

  // Until next() was called after the last frame: the reader has queued all frames.
  bool wait_for_end() {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kLimit, [&] { return is_at_end_; });
  }

  bool wait_until_given(std::size_t frames) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, kLimit, [&] { return given_ >= frames || is_at_end_; });
  }

  Clock::time_point first_given() {
    const std::scoped_lock lock(mutex_);
    return first_given_;
  }

  Clock::duration opening{};  // that the first call takes
  bool is_a_camera = false;

 private:
  std::vector<double> timestamps_;
  End end_;
  Camera camera_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::size_t given_ = 0;
  bool is_at_end_ = false;
  bool is_interrupted_ = false;
  Clock::time_point first_given_;
};

std::vector<double> every(double interval, std::size_t frames) {
  std::vector<double> timestamps;
  for (std::size_t i = 0; i < frames; ++i) timestamps.push_back(100.0 + interval * static_cast<double>(i));
  return timestamps;
}

// Until all frames are queued and the reader knows that no more come.
bool wait_for_end(FakeSource& source, const PacedReader& reader) {
  if (!source.wait_for_end()) return false;
  const auto limit = Clock::now() + kLimit;
  while (!reader.is_at_end() && Clock::now() < limit) std::this_thread::yield();
  return reader.is_at_end();
}

std::vector<std::size_t> indices_of_rest(PacedReader& reader) {
  std::vector<std::size_t> indices;
  while (const auto frame = reader.next()) indices.push_back(frame->index);
  return indices;
}

// Expects all frames, each no earlier than so long after the first (seconds). Returns when the last one came.
double expect_pace(FakeSource& source, const std::vector<double>& earliest) {
  PacedReader reader(source, 100);
  double last = 0.0;
  for (std::size_t i = 0; i < earliest.size(); ++i) {
    const auto frame = reader.next();
    const auto now = Clock::now();
    if (!frame) {
      ADD_FAILURE() << "no frame " << i;
      return last;
    }
    last = Seconds(now - source.first_given()).count();
    EXPECT_EQ(frame->index, i);
    EXPECT_GE(last, earliest[i] - 1e-6) << i;
  }
  EXPECT_FALSE(reader.next());
  EXPECT_EQ(reader.dropped(), 0U);
  return last;
}

TEST(PacedReader, HandsOutFramesNoEarlierThanTheirTimestamps) {
  FakeSource source({50.0, 50.02, 50.03, 50.1, 50.11, 50.25});
  expect_pace(source, {0.0, 0.02, 0.03, 0.1, 0.11, 0.25});
}

// Its clock may run faster or slower than that of this computer, or jump.
TEST(PacedReader, ACameraIsNotPacedByItsTimestamps) {
  FakeSource source({50.0, 60.0, 1.0, 900.0});
  source.is_a_camera = true;
  const auto begun = Clock::now();
  PacedReader reader(source, 100);
  ASSERT_TRUE(source.wait_for_end());
  const auto frame = reader.next();
  ASSERT_TRUE(frame);
  EXPECT_LT(Clock::now() - begun, std::chrono::milliseconds(900));
  EXPECT_EQ(frame->index, 3U) << "the newest";
  EXPECT_EQ(reader.dropped(), 3U);
  ASSERT_TRUE(frame->received);
  EXPECT_GE(*frame->received, begun);
  EXPECT_LE(*frame->received, Clock::now());
}

TEST(PacedReader, ACameraThatStallsIsLeftSoonAfterAStop) {
  FakeSource source({1.0}, End::kStall);
  source.is_a_camera = true;
  std::stop_source stop;
  FrameSource& camera = source;
  EXPECT_TRUE(camera.next(stop.get_token()));
  auto waiting = std::async(std::launch::async, [&] { return camera.next(stop.get_token()).has_value(); });
  ASSERT_TRUE(source.wait_for_end());
  const auto asked = Clock::now();
  stop.request_stop();
  EXPECT_FALSE(waiting.get());
  EXPECT_LT(Clock::now() - asked, std::chrono::milliseconds(200));
  EXPECT_FALSE(camera.next(stop.get_token())) << "asked after the stop";
}

TEST(PacedReader, TheClockStartsWithTheFirstFrameHoweverLongTheSourceTakesToOpen) {
  FakeSource source(every(0.02, 6));
  source.opening = std::chrono::milliseconds(200);
  expect_pace(source, {0.0, 0.02, 0.04, 0.06, 0.08, 0.1});
}

TEST(PacedReader, AGapOfAnHourIsWaitedForASecondAndThePaceIsKeptAfterIt) {
  FakeSource source({0.0, 0.02, 3600.0, 3600.1});
  EXPECT_LT(expect_pace(source, {0.0, 0.02, 1.0, 1.1}), 20.0);
}

TEST(PacedReader, ThePaceIsKeptAfterTheSourcesClockRestarts) {
  FakeSource source({1000.0, 1000.05, 0.0, 0.05, 0.15});
  EXPECT_LT(expect_pace(source, {0.0, 0.05, 0.05, 0.1, 0.2}), 20.0);
}

// Such frames are handed out too: whoever takes them counts them as not usable.
TEST(PacedReader, ThePaceIsKeptAfterATimeThatIsNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, infinity, -infinity}) {
    FakeSource first({bad, 10.0, 10.05, 10.15});
    EXPECT_LT(expect_pace(first, {0.0, 0.0, 0.05, 0.15}), 20.0) << bad;
    FakeSource repeated({10.0, bad, bad, 10.05, 10.1, 10.2});
    EXPECT_LT(expect_pace(repeated, {0.0, 0.0, 0.0, 0.0, 0.05, 0.15}), 20.0) << bad;
  }
}

TEST(PacedReader, ASlowConsumerGetsFramesSpreadOverTheStallAndTheOthersAreCounted) {
  FakeSource source(every(0.01, 20));
  PacedReader reader(source, 3);
  ASSERT_TRUE(wait_for_end(source, reader));
  EXPECT_EQ(indices_of_rest(reader), (std::vector<std::size_t>{0, 4, 8, 12, 14, 16, 18, 19}));
  EXPECT_EQ(reader.dropped(), 12U);
  EXPECT_EQ(reader.longest_gap(), 3U);
}

TEST(PacedReader, DropsNothingWhileThereIsRoom) {
  FakeSource source(every(0.001, 20));
  PacedReader reader(source, 20);
  ASSERT_TRUE(source.wait_for_end());
  const auto indices = indices_of_rest(reader);
  ASSERT_EQ(indices.size(), 20U);
  for (std::size_t i = 0; i < indices.size(); ++i) EXPECT_EQ(indices[i], i);
  EXPECT_EQ(reader.dropped(), 0U);
}

TEST(PacedReader, AccountsForEveryFrameInOrderWhileTheConsumerLagsBehind) {
  constexpr std::size_t kFrames = 100;
  FakeSource source(every(0.001, kFrames));
  PacedReader reader(source, 2);
  std::vector<std::size_t> indices;
  while (const auto frame = reader.next()) {
    indices.push_back(frame->index);
    ASSERT_TRUE(source.wait_until_given(frame->index + 8));  // longer than the queue
  }
  for (std::size_t i = 1; i < indices.size(); ++i) EXPECT_LT(indices[i - 1], indices[i]);
  EXPECT_EQ(indices.size() + reader.dropped(), kFrames);
  EXPECT_GT(reader.dropped(), kFrames / 4);
  ASSERT_GT(indices.size(), 2U);
  EXPECT_EQ(indices.back(), kFrames - 1);
}

TEST(PacedReader, ThrowsWhatTheSourceThrewAfterTheFramesBeforeIt) {
  FakeSource source(every(0.001, 3), End::kThrow);
  PacedReader reader(source, 10);
  for (std::size_t i = 0; i < 3; ++i) {
    const auto frame = reader.next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->index, i);
  }
  EXPECT_THROW(reader.next(), InputError);
  EXPECT_THROW(reader.next(), InputError);
}

TEST(PacedReader, GivesNothingAtTheEndOfASourceThatDidNotFail) {
  FakeSource source({});
  PacedReader reader(source, 10);
  EXPECT_FALSE(reader.next());
  EXPECT_FALSE(reader.next());
}

TEST(PacedReader, StoppingEndsANextThatWaitsForASourceThatStalls) {
  FakeSource source(every(0.001, 1), End::kStall);
  const auto start = Clock::now();
  {
    PacedReader reader(source, 10);
    ASSERT_TRUE(reader.next());
    ASSERT_TRUE(source.wait_for_end());
    auto frame = std::async(std::launch::async, [&] { return reader.next(); });
    EXPECT_EQ(frame.wait_for(std::chrono::milliseconds(50)), std::future_status::timeout);
    reader.stop();
    ASSERT_EQ(frame.wait_for(kLimit / 2), std::future_status::ready);
    EXPECT_FALSE(frame.get());
    EXPECT_FALSE(reader.next());
  }
  EXPECT_LT(Clock::now() - start, kLimit / 2);  // the source is not waited for
}

TEST(PacedReader, TheDestructorInterruptsASourceThatStalls) {
  FakeSource source(every(0.001, 2), End::kStall);
  const auto start = Clock::now();
  {
    PacedReader reader(source, 10);
    ASSERT_TRUE(source.wait_for_end());
  }
  EXPECT_LT(Clock::now() - start, kLimit / 2);
}

TEST(PacedReader, FramesThatWaitAreNotHandedOutAfterAStop) {
  FakeSource source(every(0.001, 5));
  PacedReader reader(source, 10);
  ASSERT_TRUE(source.wait_for_end());
  EXPECT_TRUE(reader.next());
  reader.stop();
  EXPECT_FALSE(reader.next());
  reader.stop();  // once more does no harm
  EXPECT_FALSE(reader.next());
}

TEST(PacedReader, AnErrorThatFollowsAStopIsNotThrown) {
  FakeSource source(every(0.001, 1), End::kStallAndThrow);
  PacedReader reader(source, 10);
  ASSERT_TRUE(reader.next());
  ASSERT_TRUE(source.wait_for_end());
  reader.stop();
  EXPECT_NO_THROW(EXPECT_FALSE(reader.next()));
}

}  // namespace
}  // namespace roslam
