// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace roslam {

/// Lowers the priority of the calling thread for the rest of its life. Best effort: does nothing where the
/// system has no priority per thread.
inline void lower_thread_priority() {
#ifdef __linux__
  constexpr int kNice = 10;  // about a tenth of the core where another thread is busy
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
#endif
}

}  // namespace roslam
