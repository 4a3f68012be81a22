// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace roslam {

/// How much of a core a thread gets where one of normal priority is busy.
enum class ThreadPriority {
  kThird = 3,  ///< about a third: labels, which are worth less the older they are
  kTenth = 10  ///< about a tenth: what may be done later
};

/// Lowers the priority of the calling thread for the rest of its life. Best effort: does nothing where the
/// system has no priority per thread.
inline void lower_thread_priority([[maybe_unused]] ThreadPriority priority) {
#ifdef __linux__
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), static_cast<int>(priority));  // niceness
#endif
}

}  // namespace roslam
