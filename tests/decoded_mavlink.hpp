// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "telemetry/mavlink/mavlink_frame.hpp"

namespace roslam::telemetry {

/// A number of tests/mavlink_peer.mjs, which prints what JSON has no number for as a string.
template <typename T>
T number_of(const nlohmann::json& value) {
  if (!value.is_string()) return value.get<T>();
  const auto text = value.get<std::string>();
  if constexpr (std::is_floating_point_v<T>)
    return static_cast<T>(std::stod(text));
  else if constexpr (std::is_signed_v<T>)
    return static_cast<T>(std::stoll(text));
  else
    return static_cast<T>(std::stoull(text));
}

/// Takes the fields of a message by their names in the message definitions.
class DecodedFields {
 public:
  explicit DecodedFields(const nlohmann::json& fields) : fields_(fields) {}
  ~DecodedFields() { EXPECT_EQ(taken_, fields_.size()) << "fields that nobody asked for: " << fields_; }
  DecodedFields(const DecodedFields&) = delete;
  DecodedFields& operator=(const DecodedFields&) = delete;

  template <typename T>
  void take(const char* name, T& value) {
    value = number_of<T>(next(name));
  }
  template <typename T, std::size_t kSize>
  void take(const char* name, std::array<T, kSize>& values) {
    const nlohmann::json& field = next(name);
    ASSERT_EQ(field.size(), kSize) << name;
    for (std::size_t i = 0; i < kSize; ++i) values[i] = number_of<T>(field[i]);
  }
  std::string text(const char* name) { return next(name).get<std::string>(); }

 private:
  const nlohmann::json& next(const char* name) {
    ++taken_;
    return fields_.at(name);
  }

  const nlohmann::json& fields_;
  std::size_t taken_ = 0;
};

inline void take(DecodedFields& fields, HeartbeatMessage& m) {
  fields.take("custom_mode", m.custom_mode);
  fields.take("type", m.type);
  fields.take("autopilot", m.autopilot);
  fields.take("base_mode", m.base_mode);
  fields.take("system_status", m.system_status);
  fields.take("mavlink_version", m.mavlink_version);
}

inline void take(DecodedFields& fields, TimesyncMessage& m) {
  fields.take("tc1", m.tc1);
  fields.take("ts1", m.ts1);
  fields.take("target_system", m.target_system);
  fields.take("target_component", m.target_component);
}

inline void take(DecodedFields& fields, OdometryMessage& m) {
  fields.take("time_usec", m.time_usec);
  fields.take("x", m.position[0]);
  fields.take("y", m.position[1]);
  fields.take("z", m.position[2]);
  fields.take("q", m.attitude);
  fields.take("vx", m.velocity[0]);
  fields.take("vy", m.velocity[1]);
  fields.take("vz", m.velocity[2]);
  fields.take("rollspeed", m.rates[0]);
  fields.take("pitchspeed", m.rates[1]);
  fields.take("yawspeed", m.rates[2]);
  fields.take("pose_covariance", m.pose_covariance);
  fields.take("velocity_covariance", m.velocity_covariance);
  fields.take("frame_id", m.frame_id);
  fields.take("child_frame_id", m.child_frame_id);
  fields.take("reset_counter", m.reset_counter);
  fields.take("estimator_type", m.estimator_type);
  fields.take("quality", m.quality);
}

// Texts of more than 50 letters would use the two fields at the end.
inline void take(DecodedFields& fields, StatusTextMessage& m) {
  int severity = 0, id = -1, part = -1;
  fields.take("severity", severity);
  m = StatusTextMessage(static_cast<MavlinkSeverity>(severity), fields.text("text"));
  fields.take("id", id);
  fields.take("chunk_seq", part);
  EXPECT_EQ(id, 0);
  EXPECT_EQ(part, 0);
}

inline void take(DecodedFields& fields, GpsOriginMessage& m) {
  fields.take("latitude", m.latitude);
  fields.take("longitude", m.longitude);
  fields.take("altitude", m.altitude);
  fields.take("target_system", m.target_system);
  fields.take("time_usec", m.time_usec);
}

template <typename Message>
MavlinkMessage message_of(const nlohmann::json& printed) {
  DecodedFields fields(printed);
  Message message;
  take(fields, message);
  return message;
}

/// The message that tests/mavlink_peer.mjs printed. Throws what nlohmann::json throws for a field that is
/// missing.
inline ReceivedMessage message_from(const nlohmann::json& printed) {
  const nlohmann::json& fields = printed.at("fields");
  const auto name = printed.at("name").get<std::string>();
  ReceivedMessage result;
  result.sender = {printed.at("system").get<std::uint8_t>(), printed.at("component").get<std::uint8_t>()};
  result.sequence = printed.at("sequence").get<std::uint8_t>();
  if (name == "HEARTBEAT") {
    result.message = message_of<HeartbeatMessage>(fields);
  } else if (name == "TIMESYNC") {
    result.message = message_of<TimesyncMessage>(fields);
  } else if (name == "ODOMETRY") {
    result.message = message_of<OdometryMessage>(fields);
  } else if (name == "STATUSTEXT") {
    result.message = message_of<StatusTextMessage>(fields);
  } else if (name == "SET_GPS_GLOBAL_ORIGIN") {
    result.message = message_of<GpsOriginMessage>(fields);
  } else {
    ADD_FAILURE() << "a message that nobody sends: " << printed;
  }
  return result;
}

/// All messages of a list that tests/mavlink_peer.mjs printed, in which it must have found nothing wrong.
inline std::vector<ReceivedMessage> messages_from(const nlohmann::json& printed, std::size_t bytes) {
  EXPECT_EQ(printed.at("wrong_checksums"), 0);
  EXPECT_EQ(printed.at("unknown"), 0);
  EXPECT_EQ(printed.at("bytes"), bytes) << "bytes that belong to no message";
  std::vector<ReceivedMessage> messages;
  for (const nlohmann::json& one : printed.at("messages")) messages.push_back(message_from(one));
  return messages;
}

}  // namespace roslam::telemetry
