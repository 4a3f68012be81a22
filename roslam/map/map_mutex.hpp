// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mutex>

namespace roslam {

/// Guards a map that several threads share. Who waits comes before who has just let go of it, so that a
/// thread that takes it again and again for short work does not keep the others waiting for all of it.
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
