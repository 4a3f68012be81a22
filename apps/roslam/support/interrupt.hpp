// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <csignal>
#include <map>
#include <stop_token>
#include <thread>

namespace roslam::app {

/// Turns Ctrl-C (SIGINT), SIGTERM and SIGHUP, which a closed terminal sends, into stop tokens, also where
/// libraries have started threads already. One signal more than are asked for ends the program at once, and
/// so does the second one if the program has not ended by itself after 0.15 s. SIGHUP only ever asks for the
/// first stop, as the kernel and the shell may both send it, and stays ignored if it was (nohup).
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

  /// Requested by the second signal (kTwice): leave out what takes long, as the program ends 0.15 s later.
  std::stop_token urgent_token() const { return urgent_stop_.get_token(); }

 private:
  void watch();

  int expected_;  // signals that do not end the program
  std::stop_source stop_;
  std::stop_source urgent_stop_;
  std::map<int, struct sigaction> before_;  // what the signals did before, and do again afterwards
  sigset_t watched_{};
  int signals_ = -1;  // file descriptor the signals arrive at
  int leave_ = -1;    // file descriptor that ends the thread
  std::jthread thread_;
};

}  // namespace roslam::app
