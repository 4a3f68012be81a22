// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "roslam/common/export.hpp"

namespace roslam::telemetry {

/// Who sends: every system and each of its components has a number, 1 to 255. 197 is that of visual-inertial
/// odometry.
struct ROSLAM_EXPORT MavlinkId {
  std::uint8_t system = 1;
  std::uint8_t component = 197;
  bool operator==(const MavlinkId&) const = default;
};

// Numbers of the common message set that are used here.
constexpr std::uint8_t kOnboardController = 18;  ///< MAV_TYPE
constexpr std::uint8_t kNoAutopilot = 8;         ///< MAV_AUTOPILOT_INVALID: the sender is none
constexpr std::uint8_t kBodyFrd = 12, kLocalFrd = 20;
constexpr std::uint8_t kEstimatorVision = 2, kEstimatorVio = 3;

/// MAV_STATE of a heartbeat.
enum class MavlinkState : std::uint8_t { kStandby = 3, kActive = 4, kCritical = 5 };

/// MAV_SEVERITY of a text.
enum class MavlinkSeverity : std::uint8_t { kCritical = 2, kWarning = 4, kNotice = 5, kInfo = 6 };

struct ROSLAM_EXPORT HeartbeatMessage {
  std::uint32_t custom_mode = 0;
  std::uint8_t type = kOnboardController;
  std::uint8_t autopilot = kNoAutopilot;
  std::uint8_t base_mode = 0;
  std::uint8_t system_status = 0;  ///< MavlinkState
  std::uint8_t mavlink_version = 3;
  bool operator==(const HeartbeatMessage&) const = default;
};

/// A question of another clock (tc1 = 0) or the answer to it: ts1 is the time of the one who asks, tc1 that
/// of the one who answers, nanoseconds.
struct ROSLAM_EXPORT TimesyncMessage {
  std::int64_t tc1 = 0;
  std::int64_t ts1 = 0;
  std::uint8_t target_system = 0;  ///< 0: all
  std::uint8_t target_component = 0;
  bool operator==(const TimesyncMessage&) const = default;
};

struct ROSLAM_EXPORT OdometryMessage {
  std::uint64_t time_usec = 0;
  std::array<float, 3> position{};                        ///< metres, in frame_id
  std::array<float, 4> attitude{1.0F, 0.0F, 0.0F, 0.0F};  ///< quaternion w x y z: child frame to frame_id
  std::array<float, 3> velocity{};                        ///< m/s, in child_frame_id
  std::array<float, 3> rates{};                 ///< roll, pitch, yaw speed, rad/s, in child_frame_id
  std::array<float, 21> pose_covariance{};      ///< upper triangle by rows: x y z roll pitch yaw
  std::array<float, 21> velocity_covariance{};  ///< likewise: velocity, rates
  std::uint8_t frame_id = kLocalFrd;
  std::uint8_t child_frame_id = kBodyFrd;
  std::uint8_t reset_counter = 0;
  std::uint8_t estimator_type = kEstimatorVision;
  std::int8_t quality = 0;  ///< percent; -1: failed, 0: unknown
  bool operator==(const OdometryMessage&) const = default;
};

struct ROSLAM_EXPORT StatusTextMessage {
  std::uint8_t severity = 0;    ///< MavlinkSeverity
  std::array<char, 50> text{};  ///< without a final zero if it fills the field
  StatusTextMessage() = default;
  StatusTextMessage(MavlinkSeverity severity, std::string_view text);  ///< what is too long is cut
  std::string_view words() const;
  bool operator==(const StatusTextMessage&) const = default;
};

/// SET_GPS_GLOBAL_ORIGIN: where on earth the origin of the local frame is.
struct ROSLAM_EXPORT GpsOriginMessage {
  std::int32_t latitude = 0;   ///< degrees x 1e7
  std::int32_t longitude = 0;  ///< degrees x 1e7
  std::int32_t altitude = 0;   ///< millimetres above mean sea level
  std::uint8_t target_system = 0;
  std::uint64_t time_usec = 0;
  bool operator==(const GpsOriginMessage&) const = default;
};

using MavlinkMessage =
    std::variant<HeartbeatMessage, TimesyncMessage, OdometryMessage, StatusTextMessage, GpsOriginMessage>;

/// The longest frame: head, payload, checksum, signature.
constexpr std::size_t kLongestMavlinkFrame = 10 + 255 + 2 + 13;

/// CRC-16/MCRF4XX of the bytes, begun with 0xffff or with the CRC of those before them.
ROSLAM_EXPORT std::uint16_t mavlink_crc(std::span<const std::uint8_t> bytes, std::uint16_t crc = 0xffff);

/// The message as a MAVLink 2 frame without a signature; zeros at the end of the payload are left out.
ROSLAM_EXPORT std::vector<std::uint8_t> encode(const MavlinkMessage& message, MavlinkId sender,
                                               std::uint8_t sequence);

/// A message that was received.
struct ROSLAM_EXPORT ReceivedMessage {
  MavlinkId sender;
  std::uint8_t sequence = 0;
  MavlinkMessage message;
};

/// Finds MAVLink 2 frames in a stream of bytes, whatever is between them, and reads the messages above. All
/// other messages, signed frames and those of MAVLink 1 are passed over. Keeps at most one frame that is not
/// complete yet.
class ROSLAM_EXPORT MavlinkDecoder {
 public:
  /// The messages that are complete with these bytes.
  std::vector<ReceivedMessage> add(std::span<const std::uint8_t> bytes);

  /// Forgets a frame that is not complete, as at the end of a datagram; the next byte begins a frame.
  void clear();

  std::size_t signed_frames() const { return signed_frames_; }
  std::size_t damaged_frames() const { return damaged_frames_; }  ///< known messages of a wrong checksum

 private:
  std::size_t take(std::span<const std::uint8_t> bytes, std::vector<ReceivedMessage>& messages);

  std::vector<std::uint8_t> rest_;
  bool is_in_step_ = true;  // a frame ended just before the next byte
  std::size_t signed_frames_ = 0;
  std::size_t damaged_frames_ = 0;
};

}  // namespace roslam::telemetry
