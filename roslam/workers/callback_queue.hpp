// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "roslam/options/mode.hpp"

namespace roslam {

/// Calls functions of the program. In real-time mode on a thread of its own, so that one that takes long
/// costs the calls after it and nothing else: of those that wait the oldest are dropped and counted. In
/// deterministic mode at once. What they throw is counted. May be used from any thread.
class CallbackQueue {
 public:
  explicit CallbackQueue(Mode mode);
  ~CallbackQueue();
  CallbackQueue(const CallbackQueue&) = delete;
  CallbackQueue& operator=(const CallbackQueue&) = delete;

  /// Never waits in real-time mode. Does nothing after cancel().
  void post(std::function<void()> call);

  /// Waits until all calls have been made, for a second at most. Not from within a call.
  void drain();

  /// Discards the calls that wait.
  void cancel();

  /// Discards them and waits for the one in progress; nothing is called any more.
  void stop();

  /// Whether the calling thread is in a call just now.
  bool is_inside() const;

  std::size_t dropped() const;
  std::map<std::string, std::size_t> faults() const;

 private:
  void work(const std::stop_token& stop);
  void call(const std::function<void()>& function);

  Mode mode_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<std::function<void()>> waiting_;
  bool is_busy_ = false;
  bool is_cancelled_ = false;
  std::thread::id caller_;  // of the thread that is in a call
  std::size_t dropped_ = 0;
  std::map<std::string, std::size_t> faults_;
  std::jthread thread_;  // last, so that it stops before the members it uses are destroyed
};

}  // namespace roslam
