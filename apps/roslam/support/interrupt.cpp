// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/interrupt.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <ucontext.h>
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

/// Libraries (OpenBLAS is one) start threads before main() that do not block the signals, and the kernel may
/// give one of them what is meant for the watcher. Such a thread passes it on and takes none from then on.
void pass_on(int signal, siginfo_t* /*info*/, void* context) {
  sigaddset(&static_cast<ucontext_t*>(context)->uc_sigmask, signal);
  kill(getpid(), signal);
}
}  // namespace

InterruptWatcher::InterruptWatcher(Signals signals) : expected_(signals) {
  const sigset_t set = watched_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  struct sigaction passing {};
  passing.sa_sigaction = pass_on;
  passing.sa_flags = SA_SIGINFO | SA_RESTART;
  sigaction(SIGINT, &passing, &interrupt_before_);
  sigaction(SIGTERM, &passing, &terminate_before_);
  signals_ = signalfd(-1, &set, SFD_CLOEXEC);
  leave_ = eventfd(0, EFD_CLOEXEC);
  thread_ = std::jthread([this] { watch(); });
}

InterruptWatcher::~InterruptWatcher() {
  const std::uint64_t one = 1;
  if (write(leave_, &one, sizeof(one)) == sizeof(one)) thread_.join();
  close(signals_);
  close(leave_);
  sigaction(SIGINT, &interrupt_before_, nullptr);
  sigaction(SIGTERM, &terminate_before_, nullptr);
  const sigset_t set = watched_signals();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

void InterruptWatcher::watch() {
  int received = 0;
  while (true) {
    std::array<pollfd, 2> waiting{{{signals_, POLLIN, 0}, {leave_, POLLIN, 0}}};
    if (poll(waiting.data(), waiting.size(), -1) < 0) continue;
    if (waiting[1].revents != 0) return;
    signalfd_siginfo info{};
    if (read(signals_, &info, sizeof(info)) != sizeof(info)) continue;
    constexpr int kInterrupted = 130;  // what shells report for a program ended by ctrl-C
    if (++received > expected_) _exit(kInterrupted);
    (received == 1 ? stop_ : urgent_stop_).request_stop();
  }
}

}  // namespace roslam::app
