// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/view_feed.hpp"

#include <algorithm>
#include <utility>

#include "roslam/common/stopwatch.hpp"

namespace roslam::telemetry {

namespace {
using Milliseconds = std::chrono::milliseconds;
constexpr Milliseconds kEventInterval{100};
constexpr Milliseconds kWait{500};          // for an event
constexpr Milliseconds kMapInterval{1000};  // between two snapshots
constexpr int kMapShare = 50;               // a snapshot may take a fiftieth of the time between two
constexpr Milliseconds kInterest{2500};     // after a request for the map
constexpr Milliseconds kMapPatience{2000};  // of such a request, for the first snapshot
}  // namespace

ViewFeed::ViewFeed(ViewSubject& subject, std::function<ViewCounts()> counts)
    : subject_(subject),
      counts_(std::move(counts)),
      thread_([this](const std::stop_token& stop) { work(stop); }) {}

ViewFeed::~ViewFeed() { finish(); }

void ViewFeed::add_viewer() {
  const std::scoped_lock lock(mutex_);
  ++viewers_;
  changed_.notify_all();
}

void ViewFeed::remove_viewer() {
  const std::scoped_lock lock(mutex_);
  --viewers_;
  changed_.notify_all();
}

void ViewFeed::finish() {
  std::unique_lock lock(mutex_);
  is_finishing_ = true;
  changed_.notify_all();
  changed_.wait_for(lock, Milliseconds(500), [this] { return viewers_ == 0; });
}

std::string ViewFeed::next_event(std::uint64_t& number, bool& is_last) {
  {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, number > 0 ? kWait : Milliseconds(0),
                      [&] { return is_finishing_ || event_number_ != number; });
    is_last = is_finishing_;
    const bool is_first = std::exchange(number, std::max<std::uint64_t>(event_number_, 1)) == 0;
    if (!is_last && !is_first && event_number_ > 0) return event_;
  }
  return event_json(subject_.status(), counts_());
}

const MapFeed& ViewFeed::map() {
  std::unique_lock lock(mutex_);
  const bool is_kept_up = Clock::now() - map_wanted_ < kInterest && snapshots_ > 0;
  map_wanted_ = Clock::now();
  if (is_kept_up) return map_;
  const std::uint64_t before = snapshots_;
  changed_.notify_all();
  changed_.wait_for(lock, kMapPatience, [&] { return snapshots_ != before || is_finishing_; });
  return map_;
}

ViewCounts ViewFeed::map_counts() const {
  ViewCounts counts;
  counts.map_revision = map_.revision();
  const std::scoped_lock lock(mutex_);
  counts.loops = loop_count_;
  return counts;
}

std::string ViewFeed::loops() const {
  const std::scoped_lock lock(mutex_);
  return loops_;
}

// How long until the next time.
ViewFeed::Clock::duration ViewFeed::update_map() {
  const auto begun = Clock::now();
  if (const auto map = subject_.snapshot()) map_.update(*map);
  const auto closed = subject_.loops();
  const Clock::duration taken = Clock::now() - begun;
  const std::scoped_lock lock(mutex_);
  ++snapshots_;
  loops_ = loops_json(closed);
  loop_count_ = closed.size();
  changed_.notify_all();
  return std::max<Clock::duration>(kMapInterval, kMapShare * taken);
}

void ViewFeed::make_event() {
  std::string next = event_json(subject_.status(), counts_());
  const std::scoped_lock lock(mutex_);
  if (next == event_) return;
  event_ = std::move(next);
  ++event_number_;
  changed_.notify_all();
}

void ViewFeed::work(const std::stop_token& stop) {
  auto map_due = Clock::now();
  const Stopwatch watch;
  while (!stop.stop_requested()) {
    bool wants_map = false;
    {
      std::unique_lock lock(mutex_);
      const auto is_wanted = [this] { return viewers_ > 0 || Clock::now() - map_wanted_ < kInterest; };
      if (!is_wanted()) {
        changed_.wait(lock, stop, is_wanted);
        map_due = Clock::now();
      } else {
        changed_.wait_for(lock, stop, kEventInterval, [] { return false; });
      }
      wants_map = Clock::now() - map_wanted_ < kInterest;
    }
    if (stop.stop_requested()) return;
    if (wants_map && Clock::now() >= map_due) map_due = Clock::now() + update_map();
    if (viewers_ > 0) make_event();
    cpu_seconds_ = watch.seconds();
  }
}

}  // namespace roslam::telemetry
