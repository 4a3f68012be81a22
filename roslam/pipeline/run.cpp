// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/run.hpp"

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>

#include "roslam/pipeline/bounded_queue.hpp"
#include "roslam/pipeline/statistics.hpp"

namespace roslam {

namespace {
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// Reads a source on a thread of its own and hands out frames at the pace of their timestamps.
class PacedReader {
 public:
  PacedReader(FrameSource& source, std::size_t queue_size)
      : queue_(queue_size), thread_([this, &source](const std::stop_token& stop) { read(source, stop); }) {}

  std::optional<Frame> next() {
    auto frame = queue_.pop();
    if (!frame && failure_) std::rethrow_exception(failure_);
    return frame;
  }

  void stop() { thread_.request_stop(); }
  std::size_t dropped() {
    const std::scoped_lock lock(mutex_);
    return dropped_;
  }

 private:
  void read(FrameSource& source, const std::stop_token& stop) {
    try {
      std::optional<Clock::time_point> start;
      double first_timestamp = 0.0;
      while (!stop.stop_requested()) {
        auto frame = source.next();
        if (!frame) break;
        if (!start) {
          start = Clock::now();
          first_timestamp = frame->timestamp;
        }
        const std::chrono::duration<double> age(frame->timestamp - first_timestamp);
        std::unique_lock lock(mutex_);
        tick_.wait_until(lock, stop, *start + std::chrono::duration_cast<Clock::duration>(age), [] { return false; });
        if (stop.stop_requested()) break;
        dropped_ += queue_.push(std::move(*frame));
      }
    } catch (...) {
      failure_ = std::current_exception();
    }
    queue_.close();
  }

  BoundedQueue<Frame> queue_;
  std::mutex mutex_;
  std::condition_variable_any tick_;
  std::size_t dropped_ = 0;
  std::exception_ptr failure_;  // written before the queue closes, read after
  std::jthread thread_;         // last, so that it stops before what it uses goes away
};

class Runner {
 public:
  Runner(Slam& slam, const std::function<void(const FrameResult&)>& on_frame) : slam_(slam), on_frame_(on_frame) {}

  void process(const Frame& frame) {
    const auto result = slam_.process(frame);
    if (!result) return;
    if (frame.T_world_camera) summary_.truth.push_back({frame.timestamp, *frame.T_world_camera});
    if (summary_.first_pose_seconds < 0.0 && result->T_world_camera) {
      summary_.first_pose_seconds = seconds_since(start_);
      if (const double age = process_age(); age >= 0.0) summary_.start_up_seconds = age;
    }
    if (on_frame_) on_frame_(*result);
  }

  RunSummary finish() {
    slam_.finish();
    summary_.wall_seconds = seconds_since(start_);
    return summary_;
  }

  RunSummary& summary() { return summary_; }

 private:
  Slam& slam_;
  const std::function<void(const FrameResult&)>& on_frame_;
  Clock::time_point start_ = Clock::now();
  RunSummary summary_;
};
}  // namespace

RunSummary run(FrameSource& source, Slam& slam, const std::function<void(const FrameResult&)>& on_frame,
               const std::stop_token& stop) {
  Runner runner(slam, on_frame);
  if (slam.mode() == Mode::kDeterministic) {
    while (!stop.stop_requested()) {
      const auto frame = source.next();
      if (!frame) return runner.finish();
      runner.process(*frame);
    }
    runner.summary().interrupted = true;
    return runner.finish();
  }
  PacedReader reader(source, static_cast<std::size_t>(slam.options().threads.frame_queue));
  const std::stop_callback forward(stop, [&] { reader.stop(); });
  while (!stop.stop_requested()) {
    const auto frame = reader.next();
    if (!frame) break;
    runner.process(*frame);
  }
  reader.stop();
  runner.summary().interrupted = stop.stop_requested();
  runner.summary().dropped = reader.dropped();
  return runner.finish();
}

}  // namespace roslam
