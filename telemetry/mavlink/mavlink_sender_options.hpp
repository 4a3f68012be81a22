// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "roslam/common/export.hpp"
#include "telemetry/mavlink/mavlink_frame.hpp"
#include "telemetry/mavlink/odometry_stream.hpp"

namespace roslam::telemetry {

/// Where on earth the local frame begins.
struct ROSLAM_EXPORT GeodeticOrigin {
  double latitude = 0.0;   ///< degrees, -90 to 90
  double longitude = 0.0;  ///< degrees, -180 to 180
  double altitude = 0.0;   ///< metres above mean sea level, -1000 to 10000

  /// Reads "LAT,LON,ALT". Throws InputError.
  static GeodeticOrigin from(const std::string& text);
};

struct ROSLAM_EXPORT MavlinkSenderOptions {
  OdometryStreamOptions stream;
  MavlinkId id;       ///< of this sender; neither number may be 0
  double fps = 30.0;  ///< images a second of the camera, for the warning of a slow link; 0: unknown
  std::optional<GeodeticOrigin> origin;  ///< is told to the autopilot once it is heard; never by default

  /// Without any frame, after which the camera counts as lost; at least 100. In real-time mode only.
  std::chrono::milliseconds camera_silence{3000};
  /// Without a heartbeat of an autopilot, after which is warned; at least 100.
  std::chrono::milliseconds autopilot_silence{5000};

  /// Throws OptionsError.
  void validate() const;

  /// Of all that is sent regularly, answers to ten TIMESYNC a second included.
  double bytes_per_second() const;
};

}  // namespace roslam::telemetry
