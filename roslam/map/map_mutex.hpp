// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mutex>

namespace roslam {

/// Guards a map that several threads share. Fair: who waits is next, so that a thread that takes it again and
/// again for short work never keeps the tracker waiting for longer than one such piece.
class MapMutex {
 public:
  void lock() {
    const std::scoped_lock queue(next_);
    map_.lock();
  }
  void unlock() { map_.unlock(); }

 private:
  std::mutex next_;  // held by the one who waits for the map
  std::mutex map_;
};

}  // namespace roslam
