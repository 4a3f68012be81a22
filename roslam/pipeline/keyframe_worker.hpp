// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

#include "roslam/map/ids.hpp"
#include "roslam/pipeline/options.hpp"
#include "roslam/pipeline/statistics.hpp"

namespace roslam {

/// Does some work on keyframes: at once in deterministic mode, through a queue on a thread of its own in
/// real-time mode.
class KeyframeWorker {
 public:
  /// Asked now and then by long work: true once enough keyframes wait that it should come to an end.
  using ShouldStop = std::function<bool()>;

  /// times: takes what the work cost.
  using Work = std::function<void(KeyframeId keyframe, const ShouldStop& should_stop, StageTimes& times)>;

  /// patience: keyframes that wait for long work to be told to stop, in real-time mode.
  KeyframeWorker(Work work, Mode mode, int patience);

  /// True if a keyframe would be worked on at once.
  bool is_idle() const;

  /// Keyframes that wait.
  std::size_t waiting() const;

  /// The caller must not hold the map's mutex. Rethrows what the work threw.
  void submit(KeyframeId keyframe);

  /// Waits until all keyframes are worked on. Rethrows what the work threw.
  void drain();

  /// Times of the work's steps so far.
  StageTimes times() const;

 private:
  void run(const std::stop_token& stop);
  void process(KeyframeId keyframe);

  Work work_;
  Mode mode_;
  std::size_t patience_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<KeyframeId> queue_;
  bool is_busy_ = false;
  std::exception_ptr failure_;
  StageTimes times_;
  std::jthread thread_;  // last, so that it stops before what it uses goes away
};

}  // namespace roslam
