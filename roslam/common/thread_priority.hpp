// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace roslam {

/// Niceness of threads that leave the core to those of normal priority, such as tracking.
enum class ThreadPriority {
  kLow = 10,    ///< about a tenth of a contended core: labels, which are worth less the older they are
  kLowest = 15  ///< a third of that: what may be done later
};

/// Lowers the priority of the calling thread for the rest of its life. Best effort: does nothing where the
/// system has no priority per thread.
inline void lower_thread_priority([[maybe_unused]] ThreadPriority priority) {
#ifdef __linux__
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), static_cast<int>(priority));  // niceness
#endif
}

}  // namespace roslam
