// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/timed_files.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace roslam {
namespace {

std::vector<TimedFile> at(const std::vector<double>& times) {
  std::vector<TimedFile> files;
  for (const double time : times) files.push_back({time, std::to_string(files.size())});
  return files;
}

std::vector<double> times_of(const OrderedFiles& ordered) {
  std::vector<double> times;
  for (const auto& entry : ordered.entries) times.push_back(entry.timestamp);
  return times;
}

std::vector<double> regular(double begin, int count, double interval = 0.1) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) times.push_back(begin + interval * i);
  return times;
}

TEST(OrderOfTime, AnyPermutationOfARecordingIsSorted) {
  const std::vector<double> times = regular(100.0, 60);
  std::vector<double> reversed(times.rbegin(), times.rend());
  std::vector<double> shuffled = times;
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(1));
  std::vector<double> swapped(times.begin() + 30, times.end());
  swapped.insert(swapped.end(), times.begin(), times.begin() + 30);
  std::vector<double> neighbours = times;
  for (std::size_t i = 5; i + 1 < neighbours.size(); i += 9) std::swap(neighbours[i], neighbours[i + 1]);
  for (const auto& list : {times, reversed, shuffled, swapped, neighbours}) {
    const OrderedFiles ordered = in_order_of_time(at(list));
    EXPECT_EQ(times_of(ordered), times);
    EXPECT_EQ(ordered.was_sorted, list == times);
    EXPECT_EQ(ordered.restarts + static_cast<int>(ordered.repeated + ordered.implausible), 0);
  }
}

// As ls sorts names without leading zeros.
TEST(OrderOfTime, TheOrderOfTextIsSorted) {
  for (const double begin : {0.0, 95.0}) {
    const std::vector<double> times = regular(begin, 900, 1.0 / 30.0);
    std::vector<double> as_text = times;
    std::sort(as_text.begin(), as_text.end(),
              [](double a, double b) { return std::to_string(a) < std::to_string(b); });
    const OrderedFiles ordered = in_order_of_time(at(as_text));
    EXPECT_EQ(times_of(ordered), times) << begin;
    EXPECT_EQ(ordered.restarts, 0);
    EXPECT_FALSE(ordered.was_sorted);
  }
}

TEST(OrderOfTime, NoShuffleIsTakenForARestart) {
  const std::vector<double> times = regular(10.0, 1000);
  for (unsigned seed = 0; seed < 100; ++seed) {
    std::vector<double> shuffled = times;
    std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(seed));
    EXPECT_EQ(times_of(in_order_of_time(at(shuffled))), times) << seed;
  }
}

TEST(OrderOfTime, ARestartOfTheClockIsNotSortedAway) {
  for (const double second : {100.05, 0.0, 101.0, 5.0}) {
    std::vector<double> times = regular(100.0, 40);
    const std::vector<double> after = regular(second, 40);
    times.insert(times.end(), after.begin(), after.end());
    const OrderedFiles ordered = in_order_of_time(at(times));
    EXPECT_EQ(times_of(ordered), times) << second;
    EXPECT_EQ(ordered.restarts, 1);
    EXPECT_TRUE(ordered.was_sorted);
    EXPECT_EQ(ordered.entries[39].segment, 0);
    EXPECT_EQ(ordered.entries[40].segment, 1);
  }
}

TEST(OrderOfTime, ALongerPauseIsNoRestart) {
  std::vector<double> times = regular(100.0, 40);
  const std::vector<double> after = regular(5000.0, 40);
  times.insert(times.end(), after.begin(), after.end());
  EXPECT_EQ(in_order_of_time(at(times)).restarts, 0);
  EXPECT_EQ(times_of(in_order_of_time(at(times))), times);
}

TEST(OrderOfTime, CorruptTimesAreLeftOut) {
  std::vector<double> times = regular(100.0, 40);
  times[10] = 1e9;
  times[20] = 0.0;
  times[30] = times[31];
  times[35] = times[5] + 1e-4;
  const OrderedFiles ordered = in_order_of_time(at(times));
  EXPECT_EQ(ordered.implausible, 3u);
  EXPECT_EQ(ordered.repeated, 1u);
  EXPECT_EQ(ordered.entries.size(), 36u);
  EXPECT_TRUE(std::is_sorted(ordered.entries.begin(), ordered.entries.end(),
                             [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; }));
}

TEST(OrderOfTime, OfEqualTimesTheFirstStays) {
  const OrderedFiles ordered = in_order_of_time(at({5.0, 5.0, 5.0}));
  ASSERT_EQ(ordered.entries.size(), 1u);
  EXPECT_EQ(ordered.entries[0].file, "0");
  EXPECT_EQ(ordered.repeated, 2u);
}

TEST(UnitOfTime, IsTheOneNearestToTheCamerasRate) {
  for (const double fps : {5.0, 10.0, 30.0, 90.0}) {
    for (const int every : {1, 2, 5}) {
      const double interval = every / fps;
      const double epoch = 1305031098.0;
      EXPECT_EQ(time_unit_of(at(regular(epoch, 50, interval)), fps).name, "seconds") << fps << " " << every;
      for (const auto& [unit, name] :
           {std::pair{1e-3, "milliseconds"}, {1e-6, "microseconds"}, {1e-9, "nanoseconds"}}) {
        EXPECT_EQ(time_unit_of(at(regular(epoch / unit, 50, interval / unit)), fps).name, name)
            << fps << " " << every;
      }
      const TimeUnit frames = time_unit_of(at(regular(0, 50, every)), fps);
      EXPECT_EQ(frames.name, "numbers of frames") << fps << " " << every;
      EXPECT_DOUBLE_EQ(frames.seconds, 1.0 / fps);
    }
  }
  EXPECT_EQ(time_unit_of(at(regular(0, 50, 1)), 1.0).name, "seconds");
  EXPECT_EQ(time_unit_of(at({1, 2}), 30.0).name, "seconds");
}

}  // namespace
}  // namespace roslam
