// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/mavlink/mavlink_frame.hpp"

#include <algorithm>
#include <bit>
#include <concepts>
#include <type_traits>

namespace roslam::telemetry {

namespace {
constexpr std::uint8_t kMagic = 0xfd;
constexpr std::size_t kHead = 10, kChecksum = 2, kSignature = 13;
constexpr std::uint8_t kIsSigned = 0x01;  // the only incompatibility flag there is

// What identifies a message. The last number is mixed into the checksum: it is of the message's definition.
struct Layout {
  std::uint32_t id;
  std::size_t length;  // of the payload, extensions included
  std::uint8_t crc_extra;
};
constexpr Layout layout_of(const HeartbeatMessage&) { return {0, 9, 50}; }
constexpr Layout layout_of(const TimesyncMessage&) { return {111, 18, 34}; }
constexpr Layout layout_of(const OdometryMessage&) { return {331, 233, 91}; }
constexpr Layout layout_of(const StatusTextMessage&) { return {253, 54, 83}; }
constexpr Layout layout_of(const GpsOriginMessage&) { return {48, 21, 41}; }

// The fields in the order of the wire; io writes or reads them.
template <typename Io>
void each_field(HeartbeatMessage& m, Io& io) {
  io(m.custom_mode, m.type, m.autopilot, m.base_mode, m.system_status, m.mavlink_version);
}
template <typename Io>
void each_field(TimesyncMessage& m, Io& io) {
  io(m.tc1, m.ts1, m.target_system, m.target_component);
}
template <typename Io>
void each_field(OdometryMessage& m, Io& io) {
  io(m.time_usec, m.position, m.attitude, m.velocity, m.rates, m.pose_covariance, m.velocity_covariance,
     m.frame_id, m.child_frame_id, m.reset_counter, m.estimator_type, m.quality);
}
template <typename Io>
void each_field(StatusTextMessage& m, Io& io) {
  io(m.severity, m.text);
}
template <typename Io>
void each_field(GpsOriginMessage& m, Io& io) {
  io(m.latitude, m.longitude, m.altitude, m.target_system, m.time_usec);
}

template <std::size_t kBytes>
using Bits =
    std::conditional_t<kBytes == 8, std::uint64_t,
                       std::conditional_t<kBytes == 4, std::uint32_t,
                                          std::conditional_t<kBytes == 2, std::uint16_t, std::uint8_t>>>;

// Little-endian numbers, one after the other.
class Writer {
 public:
  explicit Writer(std::vector<std::uint8_t>& bytes) : bytes_(bytes) {}

  template <typename... Fields>
  void operator()(const Fields&... fields) {
    (put(fields), ...);
  }

 private:
  template <typename T>
  void put(const T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      const auto bits = std::bit_cast<Bits<sizeof(T)>>(value);
      for (std::size_t i = 0; i < sizeof(T); ++i)
        bytes_.push_back(static_cast<std::uint8_t>(bits >> (8 * i)));
    } else {
      for (const auto& one : value) put(one);
    }
  }

  std::vector<std::uint8_t>& bytes_;
};

// Likewise; bytes that are missing are zero.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <typename... Fields>
  void operator()(Fields&... fields) {
    (get(fields), ...);
  }

 private:
  template <typename T>
  void get(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      Bits<sizeof(T)> bits = 0;
      for (std::size_t i = 0; i < sizeof(T); ++i, ++at_)
        if (at_ < bytes_.size())
          bits |= static_cast<Bits<sizeof(T)>>(Bits<sizeof(T)>{bytes_[at_]} << (8 * i));
      value = std::bit_cast<T>(bits);
    } else {
      for (auto& one : value) get(one);
    }
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
};

// A message of each type that has this number; nothing if none has.
template <std::size_t kType = 0>
std::optional<MavlinkMessage> message_of(std::uint32_t id) {
  if constexpr (kType < std::variant_size_v<MavlinkMessage>) {
    const std::variant_alternative_t<kType, MavlinkMessage> message;
    return layout_of(message).id == id ? std::optional<MavlinkMessage>(message) : message_of<kType + 1>(id);
  } else {
    return std::nullopt;
  }
}

std::uint16_t checksum_of(std::span<const std::uint8_t> frame_without, std::uint8_t crc_extra) {
  return mavlink_crc({&crc_extra, 1}, mavlink_crc(frame_without.subspan(1)));
}
}  // namespace

StatusTextMessage::StatusTextMessage(MavlinkSeverity the_severity, std::string_view words)
    : severity(static_cast<std::uint8_t>(the_severity)) {
  std::copy_n(words.begin(), std::min(words.size(), text.size()), text.begin());
}

std::string_view StatusTextMessage::words() const {
  return {text.data(), static_cast<std::size_t>(std::find(text.begin(), text.end(), '\0') - text.begin())};
}

std::uint16_t mavlink_crc(std::span<const std::uint8_t> bytes, std::uint16_t crc) {
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>(crc ^ byte);
    // The polynomial 0x1021 with its bits reversed.
    for (int bit = 0; bit < 8; ++bit)
      crc = static_cast<std::uint16_t>((crc >> 1U) ^ ((crc & 1U) != 0 ? 0x8408U : 0U));
  }
  return crc;
}

std::vector<std::uint8_t> encode(const MavlinkMessage& message, MavlinkId sender, std::uint8_t sequence) {
  std::vector<std::uint8_t> frame;
  frame.reserve(kLongestMavlinkFrame);
  std::visit(
      [&](auto m) {
        const Layout layout = layout_of(m);
        Writer put(frame);
        const auto id = [&](unsigned shift) { return static_cast<std::uint8_t>(layout.id >> shift); };
        put(kMagic, std::uint8_t{0}, std::uint8_t{0}, std::uint8_t{0}, sequence, sender.system,
            sender.component, id(0), id(8), id(16));
        each_field(m, put);
        frame.resize(kHead + layout.length);  // extensions that are not used
        while (frame.size() > kHead + 1 && frame.back() == 0) frame.pop_back();
        frame[1] = static_cast<std::uint8_t>(frame.size() - kHead);
        put(checksum_of(frame, layout.crc_extra));
      },
      message);
  return frame;
}

std::vector<ReceivedMessage> MavlinkDecoder::add(std::span<const std::uint8_t> bytes) {
  std::vector<ReceivedMessage> messages;
  rest_.insert(rest_.end(), bytes.begin(), bytes.end());
  std::size_t used = 0;
  while (used < rest_.size()) {
    const std::size_t taken = take(std::span(rest_).subspan(used), messages);
    if (taken == 0) break;
    used += taken;
  }
  rest_.erase(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(used));
  return messages;
}

void MavlinkDecoder::clear() {
  rest_.clear();
  is_in_step_ = true;
}

// The number of bytes that are done with; zero if more are needed. What is no frame is left byte by byte, as
// the next frame may begin within it. The length of a frame whose checksum cannot be known is believed if it
// follows another frame.
std::size_t MavlinkDecoder::take(std::span<const std::uint8_t> bytes,
                                 std::vector<ReceivedMessage>& messages) {
  const auto leave = [this](bool is_frame, std::size_t count) {
    is_in_step_ = is_frame;
    return count;
  };
  if (bytes[0] != kMagic) return leave(false, 1);
  if (bytes.size() < kHead) return 0;
  const std::uint8_t flags = bytes[2];
  if ((flags & ~kIsSigned) != 0) return leave(false, 1);
  const bool is_signed = (flags & kIsSigned) != 0;
  const std::size_t end = kHead + bytes[1];
  const std::size_t size = end + kChecksum + (is_signed ? kSignature : 0);
  if (bytes.size() < size) return 0;
  const std::uint32_t id =
      bytes[7] | static_cast<std::uint32_t>(bytes[8]) << 8U | static_cast<std::uint32_t>(bytes[9]) << 16U;
  auto message = message_of(id);
  if (!message) return is_in_step_ ? size : leave(false, 1);
  const std::uint8_t crc_extra = std::visit([](const auto& m) { return layout_of(m).crc_extra; }, *message);
  const std::uint16_t crc = checksum_of(bytes.first(end), crc_extra);
  if ((crc & 0xffU) != bytes[end] || (crc >> 8U) != bytes[end + 1]) {
    ++damaged_frames_;
    return leave(false, 1);
  }
  if (is_signed) {
    ++signed_frames_;
    return leave(true, size);
  }
  std::visit(
      [&](auto& m) {
        Reader get(bytes.subspan(kHead, bytes[1]));
        each_field(m, get);
      },
      *message);
  messages.push_back({{bytes[5], bytes[6]}, bytes[4], *message});
  return leave(true, size);
}

}  // namespace roslam::telemetry
