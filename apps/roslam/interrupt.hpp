// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <csignal>
#include <stop_token>
#include <thread>

namespace roslam::app {

/// Turns ctrl-C and a termination request into a stop token, also where libraries have started threads
/// already. A second ctrl-C ends the program at once.
class InterruptWatcher {
 public:
  InterruptWatcher();
  InterruptWatcher(const InterruptWatcher&) = delete;
  InterruptWatcher& operator=(const InterruptWatcher&) = delete;
  ~InterruptWatcher();

  std::stop_token token() const { return stop_.get_token(); }

 private:
  void watch();

  std::stop_source stop_;
  struct sigaction interrupt_before_ {};  // what the signals did before, and do again afterwards
  struct sigaction terminate_before_ {};
  int signals_ = -1;  // file descriptor the signals arrive at
  int leave_ = -1;    // file descriptor that ends the thread
  std::jthread thread_;
};

}  // namespace roslam::app
