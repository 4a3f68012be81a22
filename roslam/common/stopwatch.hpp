// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ctime>

namespace roslam {

/// Measures the processor time of the calling thread, in seconds. Independent of other load on the machine.
class Stopwatch {
 public:
  Stopwatch() : start_(now()) {}
  double seconds() const { return now() - start_; }

 private:
  static double now() {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }
  double start_;
};

}  // namespace roslam
