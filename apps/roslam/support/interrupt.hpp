// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <csignal>
#include <stop_token>
#include <thread>

namespace roslam::app {

/// Turns Ctrl-C (SIGINT) and SIGTERM into stop tokens, also where libraries have started threads already. One
/// signal more than are asked for ends the program at once.
class InterruptWatcher {
 public:
  /// Signals that are turned into stop tokens.
  enum Signals { kOnce = 1, kTwice = 2 };

  explicit InterruptWatcher(Signals signals = kOnce);
  InterruptWatcher(const InterruptWatcher&) = delete;
  InterruptWatcher& operator=(const InterruptWatcher&) = delete;
  ~InterruptWatcher();

  /// Requested by the first signal: end early and write what there is.
  std::stop_token token() const { return stop_.get_token(); }

  /// Requested by the second signal (kTwice): leave out what takes long.
  std::stop_token urgent_token() const { return urgent_stop_.get_token(); }

 private:
  void watch();

  int expected_;  // signals that do not end the program
  std::stop_source stop_;
  std::stop_source urgent_stop_;
  struct sigaction interrupt_before_ {};  // what the signals did before, and do again afterwards
  struct sigaction terminate_before_ {};
  int signals_ = -1;  // file descriptor the signals arrive at
  int leave_ = -1;    // file descriptor that ends the thread
  std::jthread thread_;
};

}  // namespace roslam::app
