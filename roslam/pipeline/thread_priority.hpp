// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#ifdef __linux__
#include <sys/resource.h>
#include <unistd.h>
#endif

namespace roslam {

/// Lets other threads go before the calling one where they want the same core, for good. Best effort: does
/// nothing where threads have no priority of their own.
inline void give_way_to_others() {
#ifdef __linux__
  constexpr int kNice = 10;  // about a tenth of the core where another thread is busy
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);
#endif
}

}  // namespace roslam
