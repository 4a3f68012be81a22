// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

#include "roslam/common/export.hpp"

namespace roslam {

/// How long threads held a map, and how long one of them had to wait for it. All in seconds of wall time.
struct ROSLAM_EXPORT MapLockTimes {
  std::map<std::string, double> longest_held;  ///< by what was done meanwhile
  double longest_wait = 0.0;                   ///< of those that declared themselves as urgent
  std::string waited_for;                      ///< what was done meanwhile
};

/// Mutex of a map shared between threads. A waiting thread is served before the one that has just unlocked,
/// so that a thread that locks repeatedly for short work does not starve the others. Lock it by MapLock.
class ROSLAM_EXPORT MapMutex {
 public:
  /// purpose: what is done with the map, a string that stays valid. is_urgent: waits are recorded.
  void lock(const char* purpose, bool is_urgent = false);
  void unlock();

  /// May be called from any thread.
  MapLockTimes times() const;

 private:
  using Clock = std::chrono::steady_clock;

  std::mutex next_;  // held by the thread that is next to lock map_
  std::mutex map_;
  mutable std::mutex records_;  // guards what follows; held for a moment only
  const char* purpose_ = "";    // of the thread that holds the map, or held it last
  Clock::time_point since_;
  std::map<std::string_view, double> longest_held_;
  double longest_wait_ = 0.0;
  const char* waited_for_ = "";
};

/// Locks a map's mutex for the lifetime of the object, or until unlock().
class [[nodiscard]] MapLock {
 public:
  MapLock(MapMutex& mutex, const char* purpose, bool is_urgent = false) : mutex_(&mutex) {
    mutex.lock(purpose, is_urgent);
  }
  ~MapLock() { unlock(); }
  MapLock(const MapLock&) = delete;
  MapLock& operator=(const MapLock&) = delete;

  void unlock() {
    if (mutex_ != nullptr) mutex_->unlock();
    mutex_ = nullptr;
  }

 private:
  MapMutex* mutex_;
};

}  // namespace roslam
