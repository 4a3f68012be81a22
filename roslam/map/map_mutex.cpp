// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/map/map_mutex.hpp"

#include <algorithm>

namespace roslam {

void MapMutex::lock(const char* purpose, bool is_urgent) {
  const auto begun = Clock::now();
  const char* holder = "";
  if (is_urgent) {
    const std::scoped_lock lock(records_);
    holder = purpose_;
  }
  {
    const std::scoped_lock queue(next_);
    map_.lock();
  }
  const auto now = Clock::now();
  const double waited = std::chrono::duration<double>(now - begun).count();
  const std::scoped_lock lock(records_);
  purpose_ = purpose;
  since_ = now;
  if (!is_urgent || waited <= longest_wait_) return;
  longest_wait_ = waited;
  waited_for_ = holder;
}

void MapMutex::unlock() {
  {
    const std::scoped_lock lock(records_);
    double& longest = longest_held_[purpose_];
    longest = std::max(longest, std::chrono::duration<double>(Clock::now() - since_).count());
  }
  map_.unlock();
}

MapLockTimes MapMutex::times() const {
  const std::scoped_lock lock(records_);
  MapLockTimes times;
  for (const auto& [purpose, longest] : longest_held_) times.longest_held.emplace(purpose, longest);
  times.longest_wait = longest_wait_;
  times.waited_for = waited_for_;
  return times;
}

}  // namespace roslam
