// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/mavlink/autopilot_watch.hpp"

#include <cmath>
#include <cstdint>

#include "telemetry/mavlink/companion_clock.hpp"

namespace roslam::telemetry {

void AutopilotWatch::hear(const HeartbeatMessage& heartbeat, MavlinkId from) {
  if (heartbeat.autopilot == kNoAutopilot) return;
  constexpr int kOriginTimes = 3;
  const auto now = Clock::now();
  if (!last_heard_ || now - *last_heard_ > silence_) origin_left_ = kOriginTimes;
  last_heard_ = now;
  system_ = from.system;
}

std::optional<std::string> AutopilotWatch::doubt() {
  const bool is_silent = Clock::now() - last_heard_.value_or(begun_) >= silence_;
  const bool was_doubted = is_doubted_;
  is_doubted_ = is_silent;
  if (!is_silent || was_doubted) return std::nullopt;
  return std::string(last_heard_ ? "the autopilot is not heard any more" : "no autopilot is heard") +
         (kind_ == MavlinkAddress::Kind::kSerial
              ? "; check both wires, the baud rate and the protocol (MAVLink 2) of its port"
              : "; check host and port, and that it answers from that port") +
         "; poses are sent all the same";
}

std::optional<GpsOriginMessage> AutopilotWatch::next_origin() {
  if (!origin_ || origin_left_ == 0) return std::nullopt;
  --origin_left_;
  constexpr double kDegrees = 1e7, kMetres = 1e3;
  GpsOriginMessage message;
  message.latitude = static_cast<std::int32_t>(std::lround(kDegrees * origin_->latitude));
  message.longitude = static_cast<std::int32_t>(std::lround(kDegrees * origin_->longitude));
  message.altitude = static_cast<std::int32_t>(std::lround(kMetres * origin_->altitude));
  message.target_system = static_cast<std::uint8_t>(system_.value_or(0));
  message.time_usec = static_cast<std::uint64_t>(CompanionClock::now_nanoseconds() / 1000);
  return message;
}

}  // namespace roslam::telemetry
