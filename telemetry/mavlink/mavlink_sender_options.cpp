// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/mavlink/mavlink_sender_options.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "roslam/common/error.hpp"

namespace roslam::telemetry {

GeodeticOrigin GeodeticOrigin::from(const std::string& text) {
  std::array<double, 3> values{};
  const char* at = text.data();
  const char* const end = at + text.size();
  bool is_read = true;
  for (std::size_t i = 0; i < values.size() && is_read; ++i) {
    if (i > 0) is_read = at != end && *at++ == ',';
    const auto [next, error] = std::from_chars(at, end, values[i]);
    is_read &= error == std::errc();
    at = next;
  }
  const auto [latitude, longitude, altitude] = values;
  const bool is_on_earth = std::abs(latitude) <= 90.0 && std::abs(longitude) <= 180.0 &&
                           altitude >= -1000.0 && altitude <= 10000.0;
  if (!is_read || at != end || !is_on_earth)
    throw InputError(
        "--origin " + text +
        ": is not LAT,LON,ALT (degrees, degrees, metres above the sea), such as 47.3977,8.5456,488");
  return {latitude, longitude, altitude};
}

void MavlinkSenderOptions::validate() const {
  stream.validate();
  constexpr std::chrono::milliseconds kLeast(100);
  if (id.system == 0 || id.component == 0) throw OptionsError("mavlink.id: numbers must be 1 to 255");
  if (!(fps >= 0.0)) throw OptionsError("mavlink.fps: must be at least 0");
  if (camera_silence < kLeast) throw OptionsError("mavlink.camera_silence: must be at least 100 ms");
  if (autopilot_silence < kLeast) throw OptionsError("mavlink.autopilot_silence: must be at least 100 ms");
}

double MavlinkSenderOptions::bytes_per_second() const {
  constexpr double kUsualFps = 30.0, kOverhead = 12.0, kOdometry = 233.0, kHeartbeat = 9.0, kTimesync = 18.0;
  constexpr double kTimesyncRate = 10.0;
  const double rate = std::min(fps > 0.0 ? fps : kUsualFps, stream.rate);
  return rate * (kOverhead + kOdometry) + kOverhead + kHeartbeat + kTimesyncRate * (kOverhead + kTimesync);
}

}  // namespace roslam::telemetry
