// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/run.hpp"

#include <chrono>
#include <exception>

#include "roslam/workers/paced_reader.hpp"

namespace roslam {

namespace {
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

class Runner {
 public:
  using OnFrame = std::function<void(const Frame&, const FrameResult&)>;
  Runner(Slam& slam, const OnFrame& on_frame) : slam_(slam), on_frame_(on_frame) {}

  void follow(FrameSource& source, const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      auto frame = source.next(stop);
      if (!frame) break;
      if (!frame->received) frame->received = Clock::now();
      process(*frame);
    }
    summary_.interrupted = stop.stop_requested();
  }

  void follow_in_real_time(FrameSource& source, const std::stop_token& stop) {
    PacedReader reader(source, static_cast<std::size_t>(slam_.options().threads.frame_queue));
    const std::stop_callback forward(stop, [&] { reader.stop(); });
    while (!stop.stop_requested()) {
      const auto frame = reader.next();
      summary_.dropped = reader.dropped();
      summary_.longest_gap = reader.longest_gap();
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

  RunSummary finish(const std::stop_token& stop) {
    attempt([&] { slam_.finish(); });
    summary_.interrupted |= stop.stop_requested();  // queues were discarded
    summary_.wall_seconds = seconds_since(start_);
    return std::move(summary_);
  }

 private:
  void process(const Frame& frame) {
    const FrameResult result = slam_.process(frame);
    if (!result.is_used()) return;
    if (frame.depth.empty() && frame.right.empty()) ++summary_.without_depth;
    if (frame.T_world_camera && frame.T_world_camera->is_finite()) {
      summary_.truth.push_back({frame.timestamp, *frame.T_world_camera});
    }
    if (summary_.first_pose_seconds < 0.0 && result.T_world_camera) {
      summary_.first_pose_seconds = seconds_since(start_);
    }
    if (on_frame_) on_frame_(frame, result);
  }

  Slam& slam_;
  const OnFrame& on_frame_;
  Clock::time_point start_ = Clock::now();
  RunSummary summary_;
};
}  // namespace

RunSummary run_slam(FrameSource& source, Slam& slam,
                    const std::function<void(const Frame&, const FrameResult&)>& on_frame,
                    const std::stop_token& stop) {
  Runner runner(slam, on_frame);
  const std::stop_callback cancel(stop, [&] {
    slam.cancel();
    source.interrupt();
  });
  runner.attempt([&] {
    slam.mode() == Mode::kDeterministic ? runner.follow(source, stop)
                                        : runner.follow_in_real_time(source, stop);
  });
  return runner.finish(stop);
}

}  // namespace roslam
