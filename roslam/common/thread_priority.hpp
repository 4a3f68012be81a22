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

/// Raises the priority of the calling thread, for one whose work is little and must not be late. Best effort:
/// does nothing where the user is not permitted to (RLIMIT_NICE, CAP_SYS_NICE).
inline void raise_thread_priority() {
#ifdef __linux__
  constexpr int kNiceness = -10;
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNiceness);
#endif
}

}  // namespace roslam
