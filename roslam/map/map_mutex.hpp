// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mutex>

namespace roslam {

/// Mutex of a map shared between threads. A waiting thread is served before the one that has just unlocked,
/// so that a thread that locks repeatedly for short work does not starve the others.
class MapMutex {
 public:
  void lock() {
    const std::scoped_lock queue(next_);
    map_.lock();
  }
  void unlock() { map_.unlock(); }

 private:
  std::mutex next_;  // held by the thread that is next to lock map_
  std::mutex map_;
};

}  // namespace roslam
