// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <deque>
#include <exception>
#include <mutex>
#include <thread>

#include "roslam/mapping/local_mapper.hpp"
#include "roslam/pipeline/options.hpp"
#include "roslam/pipeline/statistics.hpp"

namespace roslam {

/// Hands keyframes to the mapper: at once in deterministic mode, through a bounded queue to a thread of its
/// own in real-time mode.
class MappingWorker {
 public:
  MappingWorker(LocalMapper& mapper, Mode mode, int queue_size);

  /// True if a keyframe would be worked on at once.
  bool is_idle() const;

  /// True if another keyframe may be submitted.
  bool has_room() const;

  /// The caller must not hold the map's mutex. Rethrows what the mapper threw.
  void submit(KeyframeId keyframe);

  /// Waits until all keyframes are worked on. Rethrows what the mapper threw.
  void drain();

  /// Times of the mapper's steps so far.
  StageTimes times() const;

 private:
  void work(const std::stop_token& stop);
  void process(KeyframeId keyframe);

  LocalMapper& mapper_;
  Mode mode_;
  std::size_t queue_size_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<KeyframeId> queue_;
  bool is_busy_ = false;
  std::exception_ptr failure_;
  StageTimes times_;
  std::jthread thread_;  // last, so that it stops before what it uses goes away
};

}  // namespace roslam
