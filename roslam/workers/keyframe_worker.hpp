// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "roslam/common/stage_times.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/options/mode.hpp"

namespace roslam {

/// Processes keyframes: at once in deterministic mode, through a queue on a thread of its own in real-time
/// mode. All functions may be called from any thread.
class KeyframeWorker {
 public:
  /// Polled by long work: true when it should end early, as enough keyframes wait or the worker was
  /// cancelled.
  using ShouldStop = std::function<bool()>;

  /// times: takes what the work cost.
  using Work = std::function<void(KeyframeId keyframe, const ShouldStop& should_stop, StageTimes& times)>;

  /// What an exception of the work does.
  enum class OnFailure {
    kRethrow,   ///< the next call of submit(), check() or drain() throws it
    kSwitchOff  ///< it is counted; keyframes submitted afterwards are ignored
  };

  /// interrupt_at: keyframes that wait for ShouldStop to become true, in real-time mode.
  KeyframeWorker(Work work, Mode mode, int interrupt_at, OnFailure on_failure = OnFailure::kRethrow);

  /// Cancels, and waits for the work in progress to end.
  ~KeyframeWorker();
  KeyframeWorker(const KeyframeWorker&) = delete;
  KeyframeWorker& operator=(const KeyframeWorker&) = delete;

  /// True if a keyframe would be processed at once.
  bool is_idle() const;

  /// Keyframes in the queue.
  std::size_t waiting() const;

  /// The caller must not hold the map's mutex. Ignored once the worker was cancelled or switched off.
  void submit(KeyframeId keyframe);

  /// Throws what the work threw (OnFailure::kRethrow); does nothing otherwise. Quick.
  void check() const;

  /// Discards the queue and asks the work in progress to end.
  void cancel();
  bool is_cancelled() const { return is_cancelled_; }

  /// Waits until all keyframes are processed, or, once cancelled, until the one in progress is.
  void drain();

  /// Processor time of the work's steps so far.
  StageTimes times() const;

  /// Messages of the exceptions that were counted, and how often.
  std::map<std::string, std::size_t> faults() const;

 private:
  void run(const std::stop_token& stop);
  void process(KeyframeId keyframe);
  void note_failure(std::exception_ptr failure);

  Work work_;
  Mode mode_;
  std::size_t interrupt_at_;
  OnFailure on_failure_;
  std::atomic<bool> is_cancelled_ = false;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable_any changed_;
  std::deque<KeyframeId> queue_;
  bool is_busy_ = false;
  bool is_switched_off_ = false;
  std::exception_ptr failure_;
  StageTimes times_;
  std::map<std::string, std::size_t> faults_;
  std::jthread thread_;  // last, so that it stops before the members it uses are destroyed
};

}  // namespace roslam
