// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/workers/paced_reader.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
using Clock = std::chrono::steady_clock;
}

PacedReader::PacedReader(FrameSource& source, std::size_t queue_size)
    : source_(source),
      queue_(queue_size, source.is_live() ? FrameQueue::Policy::kNewest : FrameQueue::Policy::kSpreadDrops),
      thread_([this](const std::stop_token& stop) { read(stop); }) {}

std::optional<Frame> PacedReader::next() {
  auto frame = queue_.pop();
  if (!frame && !thread_.get_stop_token().stop_requested() && failure_) std::rethrow_exception(failure_);
  return frame;
}

void PacedReader::stop() {
  thread_.request_stop();
  source_.interrupt();
  queue_.discard();
}

void PacedReader::read(const std::stop_token& stop) {
  try {
    auto due = Clock::now();
    std::optional<double> last_timestamp;
    while (!stop.stop_requested()) {
      auto frame = source_.next(stop);
      if (!frame) break;
      if (source_.is_live()) {
        if (!frame->received) frame->received = Clock::now();
        queue_.push(std::move(*frame));
        continue;
      }
      // The clock starts when the first frame is there, however long the source took to open.
      due = last_timestamp ? due + pause(*last_timestamp, frame->timestamp) : Clock::now();
      if (std::isfinite(frame->timestamp)) last_timestamp = frame->timestamp;
      std::unique_lock lock(mutex_);
      tick_.wait_until(lock, stop, due, [] { return false; });
      if (stop.stop_requested()) break;
      frame->received = Clock::now();
      queue_.push(std::move(*frame));
    }
  } catch (...) {
    failure_ = std::current_exception();
  }
  queue_.close();
}

// A gap of hours in a recording must not make the program seem to hang.
Clock::duration PacedReader::pause(double from, double to) {
  constexpr double kLongest = 1.0;                         // seconds
  if (!std::isfinite(to)) return Clock::duration::zero();  // the pipeline rejects such a frame
  return std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(std::clamp(to - from, 0.0, kLongest)));
}

}  // namespace roslam
