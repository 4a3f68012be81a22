// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/interrupt.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdint>

namespace roslam::app {

namespace {
sigset_t watched_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}
}  // namespace

InterruptWatcher::InterruptWatcher() {
  const sigset_t set = watched_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  signals_ = signalfd(-1, &set, SFD_CLOEXEC);
  leave_ = eventfd(0, EFD_CLOEXEC);
  thread_ = std::jthread([this] { watch(); });
}

InterruptWatcher::~InterruptWatcher() {
  const std::uint64_t one = 1;
  if (write(leave_, &one, sizeof(one)) == sizeof(one)) thread_.join();
  close(signals_);
  close(leave_);
  const sigset_t set = watched_signals();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

void InterruptWatcher::watch() {
  bool asked_before = false;
  while (true) {
    std::array<pollfd, 2> waiting{{{signals_, POLLIN, 0}, {leave_, POLLIN, 0}}};
    if (poll(waiting.data(), waiting.size(), -1) < 0) continue;
    if (waiting[1].revents != 0) return;
    signalfd_siginfo info{};
    if (read(signals_, &info, sizeof(info)) != sizeof(info)) continue;
    constexpr int kInterrupted = 130;  // what shells report for a program ended by ctrl-C
    if (asked_before) _exit(kInterrupted);
    asked_before = true;
    stop_.request_stop();
  }
}

}  // namespace roslam::app
