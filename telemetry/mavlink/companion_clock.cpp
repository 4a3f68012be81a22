// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/mavlink/companion_clock.hpp"

#include <algorithm>
#include <cmath>

namespace roslam::telemetry {

std::uint64_t CompanionClock::time_of(double timestamp, Clock::time_point received, bool begins_segment) {
  const double arrival = std::chrono::duration<double>(received.time_since_epoch()).count();
  if (begins_segment || !begun_ || timestamp < *begun_) {
    begun_ = timestamp;
    least_ = least_before_ = kNone;
  } else if (timestamp - *begun_ >= window_) {
    begun_ = timestamp;
    least_before_ = least_;
    least_ = kNone;
  }
  least_ = std::min(least_, arrival - timestamp);
  constexpr double kMicroseconds = 1e6;
  const double time = std::max(0.0, timestamp + std::min(least_, least_before_)) * kMicroseconds;
  last_ = std::max(last_ + 1, static_cast<std::uint64_t>(std::llround(time)));
  return last_;
}

}  // namespace roslam::telemetry
