// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <optional>

#include "roslam/common/export.hpp"

namespace roslam::telemetry {

/// The times of images on the clock of this computer (steady clock), by their timestamps on the clock of the
/// camera and the times at which they were received. What is least of the difference of the two in the last
/// 10 to 20 s is taken for the offset between the clocks, so that jitter of the transfer has no effect and
/// drift of the clocks is followed. The offset holds the shortest time from the middle of the exposure to the
/// receipt, which nothing here can tell. Not thread safe.
class ROSLAM_EXPORT CompanionClock {
 public:
  using Clock = std::chrono::steady_clock;

  /// window: seconds of timestamps over which a difference counts once and at most twice; > 0.
  explicit CompanionClock(double window = 10.0) : window_(window) {}

  /// The time of an image, microseconds of the steady clock: later than that of the image before, and not
  /// later than its receipt unless that was before the image before. begins_segment: the camera's clock began
  /// anew.
  std::uint64_t time_of(double timestamp, Clock::time_point received, bool begins_segment = false);

  /// Now, nanoseconds of the same clock.
  static std::int64_t now_nanoseconds() {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch()).count();
  }

 private:
  static constexpr double kNone = std::numeric_limits<double>::infinity();

  double window_;
  std::optional<double> begun_;                  // timestamp at which the window began
  double least_ = kNone, least_before_ = kNone;  // seconds: in this window, in the one before
  std::uint64_t last_ = 0;
};

}  // namespace roslam::telemetry
