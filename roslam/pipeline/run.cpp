// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/run.hpp"

#include <algorithm>
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

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

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
      auto due = Clock::now();
      std::optional<double> last_timestamp;
      while (!stop.stop_requested()) {
        auto frame = source.next();
        if (!frame) break;
        // The clock starts when the first frame is there, however long the source took to open.
        due = last_timestamp ? due + pause(*last_timestamp, frame->timestamp) : Clock::now();
        last_timestamp = frame->timestamp;
        std::unique_lock lock(mutex_);
        tick_.wait_until(lock, stop, due, [] { return false; });
        if (stop.stop_requested()) break;
        dropped_ += queue_.push(std::move(*frame));
      }
    } catch (...) {
      failure_ = std::current_exception();
    }
    queue_.close();
  }

  // A recording with a gap of hours must not make the program seem to hang.
  static Clock::duration pause(double from, double to) {
    constexpr double kLongest = 1.0;  // seconds
    return std::chrono::duration_cast<Clock::duration>(
        std::chrono::duration<double>(std::clamp(to - from, 0.0, kLongest)));
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
  using OnFrame = std::function<void(const Frame&, const FrameResult&)>;
  Runner(Slam& slam, const OnFrame& on_frame) : slam_(slam), on_frame_(on_frame) {}

  void follow(FrameSource& source, const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      const auto frame = source.next();
      if (!frame) return;
      process(*frame);
    }
    summary_.interrupted = true;
  }

  void follow_in_real_time(FrameSource& source, const std::stop_token& stop) {
    PacedReader reader(source, static_cast<std::size_t>(slam_.options().threads.frame_queue));
    const std::stop_callback forward(stop, [&] { reader.stop(); });
    while (!stop.stop_requested()) {
      const auto frame = reader.next();
      summary_.dropped = reader.dropped();
      if (!frame) break;
      process(*frame);
    }
    summary_.interrupted = stop.stop_requested();
  }

  // Runs a step; what it throws is kept for the summary.
  template <typename Step>
  void attempt(const Step& step) {
    try {
      step();
    } catch (...) {
      if (!summary_.failure) summary_.failure = std::current_exception();
    }
  }

  RunSummary finish() {
    attempt([&] { slam_.finish(); });
    summary_.wall_seconds = seconds_since(start_);
    return std::move(summary_);
  }

 private:
  void process(const Frame& frame) {
    const auto result = slam_.process(frame);
    if (!result) return;
    if (frame.depth.empty()) ++summary_.without_depth;
    if (frame.T_world_camera && frame.T_world_camera->is_finite()) {
      summary_.truth.push_back({frame.timestamp, *frame.T_world_camera});
    }
    if (summary_.first_pose_seconds < 0.0 && result->T_world_camera) {
      summary_.first_pose_seconds = seconds_since(start_);
      if (const double age = process_age(); age >= 0.0) summary_.start_up_seconds = age;
    }
    if (on_frame_) on_frame_(frame, *result);
  }

  Slam& slam_;
  const OnFrame& on_frame_;
  Clock::time_point start_ = Clock::now();
  RunSummary summary_;
};
}  // namespace

RunSummary run(FrameSource& source, Slam& slam,
               const std::function<void(const Frame&, const FrameResult&)>& on_frame,
               const std::stop_token& stop) {
  Runner runner(slam, on_frame);
  runner.attempt([&] {
    slam.mode() == Mode::kDeterministic ? runner.follow(source, stop)
                                        : runner.follow_in_real_time(source, stop);
  });
  return runner.finish();
}

}  // namespace roslam
