// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>

#include "roslam/sensors/frame_source.hpp"

namespace roslam {

/// Frames between a camera and a tracker that may be slower. What is dropped is spread over time, as a gap of
/// many frames costs the tracker more than many gaps of one: while more frames wait than should, each pop()
/// passes over one; if there is no room at all, every second frame that waits is dropped. Where the latency
/// matters more, as with a camera, the newest frame is taken and all others are dropped.
class FrameQueue {
 public:
  enum class Policy { kSpreadDrops, kNewest };

  /// relaxed: frames that may wait without any being dropped; four times as many have room.
  explicit FrameQueue(std::size_t relaxed, Policy policy = Policy::kSpreadDrops)
      : relaxed_(relaxed), room_(4 * relaxed), policy_(policy) {}

  /// Never waits.
  void push(Frame frame);

  /// Waits for a frame; nothing once the queue is closed and empty.
  std::optional<Frame> pop();

  /// Removes all frames and closes the queue: frames that are pushed from now on are lost.
  void discard();

  /// No more frames will come.
  void close();

  bool is_closed() const;

  std::size_t dropped() const;

  /// The most frames dropped between two that were handed out.
  std::size_t longest_gap() const;

 private:
  struct Waiting {
    Frame frame;
    std::size_t number;  // of all that were pushed
  };

  void drop_front(std::deque<Waiting>& queue, Frame& next);

  std::size_t relaxed_;
  std::size_t room_;
  Policy policy_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> queue_;
  std::size_t pushed_ = 0;
  std::size_t expected_ = 0;  // number of the frame after the last that was handed out
  std::size_t dropped_ = 0;
  std::size_t longest_gap_ = 0;
  bool closed_ = false;
};

}  // namespace roslam
