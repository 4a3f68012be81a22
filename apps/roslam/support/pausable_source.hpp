// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>

#include "simulation/wrapped_source.hpp"

namespace roslam::app {

/// A source that can be paused. After a pause, frames that are to come at the pace of their timestamps do
/// so, and are not made up for.
class PausableSource : public simulation::WrappedSource {
 public:
  /// is_paced: the reader takes frames at the pace of their timestamps. source must outlive the object.
  PausableSource(FrameSource& source, bool is_paced)
      : WrappedSource(source), is_paced_(is_paced && !source.is_live()) {}

  /// Safe from any thread.
  void pause(bool is_paused);

  std::optional<Frame> next() override;
  void interrupt() override;

 private:
  using Clock = std::chrono::steady_clock;

  bool is_paced_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_paused_ = false, is_interrupted_ = false;
  std::optional<Clock::time_point> due_;  // of the frame before, once there was a pause
  double timestamp_ = 0.0;                // seconds, of that frame
};

}  // namespace roslam::app
