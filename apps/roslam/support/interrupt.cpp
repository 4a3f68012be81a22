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
/// Libraries (OpenBLAS is one) start threads before main() that do not block the signals, and the kernel may
/// give one of them what is meant for the watcher. Such a thread passes it on and takes none from then on.
void pass_on(int signal, siginfo_t* /*info*/, void* context) {
  sigaddset(&static_cast<ucontext_t*>(context)->uc_sigmask, signal);
  kill(getpid(), signal);
}
}  // namespace

InterruptWatcher::InterruptWatcher(Signals signals) : expected_(signals) {
  sigemptyset(&watched_);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    if (signal == SIGHUP && before.sa_handler == SIG_IGN) continue;
    before_[signal] = before;
    sigaddset(&watched_, signal);
  }
  pthread_sigmask(SIG_BLOCK, &watched_, nullptr);
  struct sigaction passing {};
  passing.sa_sigaction = pass_on;
  passing.sa_flags = SA_SIGINFO | SA_RESTART;
  for (const auto& [signal, before] : before_) sigaction(signal, &passing, nullptr);
  signals_ = signalfd(-1, &watched_, SFD_CLOEXEC);
  leave_ = eventfd(0, EFD_CLOEXEC);
  thread_ = std::jthread([this] { watch(); });
}

InterruptWatcher::~InterruptWatcher() {
  const std::uint64_t one = 1;
  if (write(leave_, &one, sizeof(one)) == sizeof(one)) thread_.join();
  close(signals_);
  close(leave_);
  for (const auto& [signal, before] : before_) sigaction(signal, &before, nullptr);
  pthread_sigmask(SIG_UNBLOCK, &watched_, nullptr);
}

void InterruptWatcher::watch() {
  constexpr int kInterrupted = 130;  // what shells report for a program ended by Ctrl-C
  constexpr int kPatience = 150;     // milliseconds
  int received = 0;
  while (true) {
    std::array<pollfd, 2> waiting{{{signals_, POLLIN, 0}, {leave_, POLLIN, 0}}};
    const int ready = poll(waiting.data(), waiting.size(), received > 1 ? kPatience : -1);
    if (ready == 0) _exit(kInterrupted);
    if (ready < 0) continue;
    if (waiting[1].revents != 0) return;
    signalfd_siginfo info{};
    if (read(signals_, &info, sizeof(info)) != sizeof(info)) continue;
    if (received > 0 && info.ssi_signo == SIGHUP) continue;
    if (++received > expected_) _exit(kInterrupted);
    (received == 1 ? stop_ : urgent_stop_).request_stop();
  }
}

}  // namespace roslam::app
