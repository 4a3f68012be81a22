// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "telemetry/mavlink/mavlink_frame.hpp"
#include "telemetry/mavlink/mavlink_link.hpp"
#include "telemetry/mavlink/mavlink_sender_options.hpp"

namespace roslam::telemetry {

/// Follows whether an autopilot is heard. Not thread safe.
class AutopilotWatch {
 public:
  using Clock = std::chrono::steady_clock;

  AutopilotWatch(MavlinkAddress::Kind kind, const MavlinkSenderOptions& options)
      : kind_(kind), silence_(options.autopilot_silence), origin_(options.origin) {}

  /// Takes a heartbeat; those of ground stations and companions do not count.
  void hear(const HeartbeatMessage& heartbeat, MavlinkId from);

  /// A warning in words, once when it is silent for too long, and again after it was heard meanwhile.
  std::optional<std::string> doubt();

  /// The origin it is to be told now: three times after it was heard, as a message may be lost, and again
  /// after a silence, as it may have begun anew.
  std::optional<GpsOriginMessage> next_origin();

  /// Its number; nothing if it was never heard.
  std::optional<int> system() const { return system_; }

 private:
  MavlinkAddress::Kind kind_;
  std::chrono::milliseconds silence_;
  std::optional<GeodeticOrigin> origin_;
  Clock::time_point begun_ = Clock::now();
  std::optional<Clock::time_point> last_heard_;
  std::optional<int> system_;
  int origin_left_ = 0;
  bool is_doubted_ = false;
};

}  // namespace roslam::telemetry
