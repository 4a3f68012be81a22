// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "roslam/sensors/frame_source.hpp"
#include "roslam/workers/frame_queue.hpp"

namespace roslam {

/// Reads a source on a thread of its own. Frames of a recorded one are handed out at the pace of their
/// timestamps, as a camera would; those of a camera as they come, as its clock may be faster or slower than
/// this computer's. Frames that nobody takes in time are dropped and counted (FrameQueue).
class PacedReader {
 public:
  /// source must outlive the reader and is used by nobody else meanwhile. queue_size: frames that may wait
  /// without any being dropped.
  PacedReader(FrameSource& source, std::size_t queue_size);
  ~PacedReader() { stop(); }
  PacedReader(const PacedReader&) = delete;
  PacedReader& operator=(const PacedReader&) = delete;

  /// Waits for the next frame; nothing at the end of the source or after stop(). Throws what the source
  /// threw.
  std::optional<Frame> next();

  /// Ends reading: next() returns at once, the frames that wait are not handed out. May be called from any
  /// thread.
  void stop();

  /// Whether the source has ended: what next() gives now is all that is left.
  bool is_at_end() const { return queue_.is_closed(); }

  std::size_t dropped() const { return queue_.dropped(); }

  /// The most frames dropped in a row.
  std::size_t longest_gap() const { return queue_.longest_gap(); }

 private:
  void read(const std::stop_token& stop);
  static std::chrono::steady_clock::duration pause(double from, double to);

  FrameSource& source_;
  FrameQueue queue_;
  std::mutex mutex_;
  std::condition_variable_any tick_;
  std::exception_ptr failure_;  // written before the queue closes, read after
  std::jthread thread_;         // last, so that it stops before the members it uses are destroyed
};

}  // namespace roslam
