// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "telemetry/view/map_feed.hpp"
#include "telemetry/view/status_text.hpp"
#include "telemetry/view/view_subject.hpp"

namespace roslam::telemetry {

/// What viewers read of a run, made on a thread of its own while there are any. It has normal priority, as
/// one of low priority must not hold the map. Threads: any.
class ViewFeed {
 public:
  /// subject must outlive the feed. counts: of the server, called by the feed's thread.
  ViewFeed(ViewSubject& subject, std::function<ViewCounts()> counts);
  ~ViewFeed();

  void add_viewer();
  void remove_viewer();
  std::size_t viewers() const { return viewers_; }

  /// Waits for an event later than that of the number, half a second at most, and gives the newest: who reads
  /// slowly misses some. number: then of that event, the same if there is no later one. is_last: the feed
  /// ends, and the event tells its last state.
  std::string next_event(std::uint64_t& number, bool& is_last);

  /// Of the map, not older than a few seconds: waits for the first one.
  const MapFeed& map();

  /// Of the map: its revision and closed loops.
  ViewCounts map_counts() const;
  std::string loops() const;

  /// Gives viewers their last event. Returns when they have left, or after half a second.
  void finish();

  double cpu_seconds() const { return cpu_seconds_; }

 private:
  using Clock = std::chrono::steady_clock;

  void work(const std::stop_token& stop);
  Clock::duration update_map();
  void make_event();

  ViewSubject& subject_;
  std::function<ViewCounts()> counts_;
  MapFeed map_;
  std::atomic<std::size_t> viewers_ = 0;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable_any changed_;
  std::string event_;
  std::uint64_t event_number_ = 0;
  Clock::time_point map_wanted_;  // when it was asked for
  std::uint64_t snapshots_ = 0;
  std::string loops_ = "[]";
  std::size_t loop_count_ = 0;
  bool is_finishing_ = false;
  std::atomic<double> cpu_seconds_ = 0.0;
  std::jthread thread_;  // last, as it uses the rest
};

}  // namespace roslam::telemetry
