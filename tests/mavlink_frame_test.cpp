// SPDX-License-Identifier: BSD-3-Clause
// Frames of MAVLink 2 against bytes that another implementation made, and a decoder that gets anything.
#include "telemetry/mavlink/mavlink_frame.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <string>

namespace roslam::telemetry {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::string hex(const Bytes& bytes) {
  static const char* kDigits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) text += {kDigits[byte >> 4U], kDigits[byte & 15U]};
  return text;
}

// CRC-16/MCRF4XX a byte at a time, as the MAVLink guide writes it; the library goes bit by bit.
std::uint16_t guide_crc(const Bytes& bytes) {
  unsigned crc = 0xffff;
  for (const std::uint8_t byte : bytes) {
    unsigned t = (byte ^ crc) & 0xffU;
    t = (t ^ (t << 4U)) & 0xffU;
    crc = ((crc >> 8U) ^ (t << 8U) ^ (t << 3U) ^ (t >> 4U)) & 0xffffU;
  }
  return static_cast<std::uint16_t>(crc);
}

// A frame by hand, of any kind.
Bytes frame_of(std::uint32_t id, const Bytes& payload, std::uint8_t crc_extra, std::uint8_t flags = 0) {
  const auto byte = [id](unsigned shift) { return static_cast<std::uint8_t>(id >> shift); };
  Bytes frame;
  for (const std::uint8_t one :
       {std::uint8_t{0xfd}, static_cast<std::uint8_t>(payload.size()), flags, std::uint8_t{0},
        std::uint8_t{7}, std::uint8_t{2}, std::uint8_t{3}, byte(0), byte(8), byte(16)})
    frame.push_back(one);
  for (const std::uint8_t one : payload) frame.push_back(one);
  Bytes checked(frame.begin() + 1, frame.end());
  checked.push_back(crc_extra);
  const std::uint16_t crc = guide_crc(checked);
  frame.push_back(static_cast<std::uint8_t>(crc & 0xffU));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8U));
  if ((flags & 1U) != 0) frame.resize(frame.size() + 13, 0xfd);
  return frame;
}

OdometryMessage golden_odometry() {
  OdometryMessage m;
  m.time_usec = 1'500'000;
  m.position = {1.0F, -2.0F, 0.5F};
  m.velocity = {0.25F, 0.0F, 0.0F};
  for (const std::size_t i : {0U, 6U, 11U}) {
    m.pose_covariance[i] = 0.01F;
    m.velocity_covariance[i] = 0.04F;
  }
  for (const std::size_t i : {15U, 18U, 20U}) m.pose_covariance[i] = 0.001F;
  m.reset_counter = 3;
  m.quality = 80;
  return m;
}

HeartbeatMessage active() {
  HeartbeatMessage m;
  m.system_status = static_cast<std::uint8_t>(MavlinkState::kActive);
  return m;
}

GpsOriginMessage origin() { return {473977000, 85456000, 488000, 1, 12}; }

std::vector<MavlinkMessage> one_of_each() {
  return {active(), TimesyncMessage{1'000'000'000, -2, 5, 6}, golden_odometry(),
          StatusTextMessage(MavlinkSeverity::kWarning, "RO-SLAM: lost"), origin()};
}

TEST(MavlinkFrame, IsByteIdenticalToThatOfAnotherImplementation) {
  const MavlinkId id{1, 197};
  EXPECT_EQ(hex(encode(active(), id, 0)), "fd0900000001c50000000000000012080004031ee4");
  EXPECT_EQ(hex(encode(TimesyncMessage{1'000'000'000, 2'000'000'000, 0, 0}, id, 1)),
            "fd0c00000101c56f000000ca9a3b0000000000943577ed60");
  EXPECT_EQ(hex(encode(StatusTextMessage(MavlinkSeverity::kWarning, "RO-SLAM: lost"), id, 3)),
            "fd0e00000301c5fd000004524f2d534c414d3a206c6f7374a277");
  EXPECT_EQ(
      hex(encode(golden_odometry(), id, 2)),
      "fde900000201c54b010060e31600000000000000803f000000c00000003f0000803f000000000000000000000000000080"
      "3e00000000000000000000000000000000000000000ad7233c00000000000000000000000000000000000000000ad7233c"
      "000000000000000000000000000000000ad7233c0000000000000000000000006f12833a00000000000000006f12833a00"
      "0000006f12833a0ad7233d00000000000000000000000000000000000000000ad7233d0000000000000000000000000000"
      "00000ad7233d000000000000000000000000000000000000000000000000000000000000000000000000140c0302502863");
}

TEST(MavlinkFrame, HasTheChecksumOfTheGuide) {
  const std::uint8_t digits[] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(mavlink_crc(digits), 0x6f91);  // the check value of CRC-16/MCRF4XX
  const std::uint8_t extras[] = {50, 34, 91, 83, 41};
  const auto messages = one_of_each();
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const Bytes frame = encode(messages[i], {9, 8}, 200);
    Bytes checked(frame.begin() + 1, frame.end() - 2);
    checked.push_back(extras[i]);
    const std::uint16_t crc = guide_crc(checked);
    EXPECT_EQ(frame[frame.size() - 2], crc & 0xffU) << i;
    EXPECT_EQ(frame.back(), crc >> 8U) << i;
    EXPECT_EQ(frame.size(), 12U + frame[1]);
  }
}

TEST(MavlinkFrame, IsDecodedToWhatWasEncoded) {
  MavlinkDecoder decoder;
  std::uint8_t sequence = 250;
  for (const MavlinkMessage& message : one_of_each()) {
    const auto found = decoder.add(encode(message, {42, 197}, ++sequence));
    ASSERT_EQ(found.size(), 1U);
    EXPECT_EQ(found[0].message, message);
    EXPECT_EQ(found[0].sender, (MavlinkId{42, 197}));
    EXPECT_EQ(found[0].sequence, sequence);
  }
  EXPECT_EQ(decoder.damaged_frames(), 0U);
}

TEST(MavlinkFrame, KeepsNanAndExtremesOfNumbers) {
  OdometryMessage m;
  m.time_usec = std::numeric_limits<std::uint64_t>::max();
  m.pose_covariance[0] = std::numeric_limits<float>::quiet_NaN();
  m.quality = -1;
  m.rates = {-0.0F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::denorm_min()};
  MavlinkDecoder decoder;
  const auto found = decoder.add(encode(m, {}, 0));
  ASSERT_EQ(found.size(), 1U);
  const auto& back = std::get<OdometryMessage>(found[0].message);
  EXPECT_TRUE(std::isnan(back.pose_covariance[0]));
  EXPECT_EQ(back.time_usec, m.time_usec);
  EXPECT_EQ(back.quality, -1);
  EXPECT_EQ(back.rates, m.rates);
  EXPECT_TRUE(std::signbit(back.rates[0]));
}

TEST(MavlinkFrame, LeavesOutZerosAtTheEndButForTheFirstByte) {
  EXPECT_EQ(encode(TimesyncMessage{}, {}, 0)[1], 1);
  EXPECT_EQ(encode(TimesyncMessage{0, 1, 0, 0}, {}, 0)[1], 9);
  EXPECT_EQ(encode(TimesyncMessage{0, 1, 0, 1}, {}, 0)[1], 18);
  MavlinkDecoder decoder;
  const auto found = decoder.add(encode(TimesyncMessage{}, {}, 0));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(std::get<TimesyncMessage>(found[0].message), TimesyncMessage{});
}

TEST(MavlinkFrame, CutsTextsThatAreTooLong) {
  const StatusTextMessage text(MavlinkSeverity::kInfo, std::string(80, 'x'));
  EXPECT_EQ(text.words(), std::string(50, 'x'));
  MavlinkDecoder decoder;
  const auto found = decoder.add(encode(text, {}, 0));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(std::get<StatusTextMessage>(found[0].message).words(), std::string(50, 'x'));
}

// Newer definitions append fields; what is not known of them is passed over.
TEST(MavlinkDecoder, TakesPayloadsLongerThanItKnows) {
  Bytes payload(40, 9);
  MavlinkDecoder decoder;
  const auto found = decoder.add(frame_of(111, payload, 34));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(std::get<TimesyncMessage>(found[0].message).target_component, 9);
}

TEST(MavlinkDecoder, FindsFramesByteByByteBetweenGarbage) {
  Bytes stream{0, 0xfd, 0x12, 0xfe, 0xfd, 0xfd};
  const auto messages = one_of_each();
  for (const MavlinkMessage& message : messages) {
    const Bytes frame = encode(message, {}, 0);
    stream.insert(stream.end(), frame.begin(), frame.end());
    stream.insert(stream.end(), {0xfd, 0x00, 0x55, 0xfd});
  }
  stream.resize(stream.size() + 300, 0);  // ends what a false beginning waits for
  MavlinkDecoder at_once, by_byte;
  std::vector<ReceivedMessage> found;
  for (const std::uint8_t byte : stream)
    for (const auto& one : by_byte.add({&byte, 1})) found.push_back(one);
  const auto all = at_once.add(stream);
  ASSERT_EQ(all.size(), messages.size());
  ASSERT_EQ(found.size(), messages.size());
  for (std::size_t i = 0; i < messages.size(); ++i) {
    EXPECT_EQ(all[i].message, messages[i]);
    EXPECT_EQ(found[i].message, messages[i]);
  }
}

TEST(MavlinkDecoder, RefusesEveryDamagedByteAndFindsTheNextFrame) {
  const Bytes good = encode(golden_odometry(), {}, 0);
  const Bytes next = encode(active(), {}, 1);
  for (std::size_t at = 0; at < good.size(); ++at) {
    Bytes stream = good;
    stream[at] ^= 0x24;
    stream.insert(stream.end(), next.begin(), next.end());
    stream.resize(stream.size() + 600, 0);
    MavlinkDecoder decoder;
    const auto found = decoder.add(stream);
    // A length that is damaged may cost the frame after it, never give a wrong one.
    for (const auto& one : found) EXPECT_EQ(one.message, MavlinkMessage(active())) << at;
    if (at != 1 && (at < 7 || at > 9)) {
      EXPECT_EQ(found.size(), 1U) << at;
    }
  }
}

TEST(MavlinkDecoder, PassesOverSignedFramesUnknownMessagesAndMavlink1) {
  Bytes stream = frame_of(0, {0, 0, 0, 0, 2, 12, 0, 4, 3}, 50, 1);              // signed
  const Bytes unknown = frame_of(30, Bytes(28, 0xfd), 39);                      // ATTITUDE
  const Bytes mavlink1{0xfe, 9, 0, 1, 1, 0, 0, 0, 0, 0, 2, 12, 0, 4, 3, 1, 2};  // HEARTBEAT
  const Bytes future = frame_of(0, {0, 0, 0, 0, 2, 12, 0, 4, 3}, 50, 2);        // a flag nobody knows
  const Bytes good = encode(TimesyncMessage{0, 77, 0, 0}, {}, 0);
  for (const Bytes& part : {unknown, mavlink1, future, good})
    stream.insert(stream.end(), part.begin(), part.end());
  stream.resize(stream.size() + 300, 0);
  MavlinkDecoder decoder;
  const auto found = decoder.add(stream);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(std::get<TimesyncMessage>(found[0].message).ts1, 77);
  EXPECT_EQ(decoder.signed_frames(), 1U);
}

TEST(MavlinkDecoder, ForgetsWhatADatagramLeft) {
  const Bytes frame = encode(active(), {}, 0);
  MavlinkDecoder decoder;
  EXPECT_TRUE(decoder.add(std::span(frame).first(12)).empty());
  decoder.clear();
  EXPECT_TRUE(decoder.add(std::span(frame).subspan(12)).empty());
  EXPECT_EQ(decoder.add(frame).size(), 1U);
}

// Random bytes, and random changes of good frames: what comes out is what went in. A checksum of 16 bits lets
// one damaged frame of 65536 pass.
TEST(MavlinkDecoder, SurvivesGarbage) {
  std::mt19937 random(7);
  const auto messages = one_of_each();
  MavlinkDecoder decoder;
  std::size_t found = 0, wrong = 0;
  for (int round = 0; round < 20000; ++round) {
    Bytes bytes;
    if (random() % 2 == 0) {
      bytes.resize(random() % 300);
      for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random() % 8 == 0 ? 0xfd : random());
    } else {
      bytes = encode(messages[random() % messages.size()], {}, static_cast<std::uint8_t>(round));
      if (random() % 4 == 0) bytes.resize(random() % bytes.size());
      if (!bytes.empty() && random() % 2 == 0) {
        auto& byte = bytes[random() % bytes.size()];
        byte = static_cast<std::uint8_t>(byte ^ (1U << (random() % 8)));
      }
    }
    for (const auto& one : decoder.add(bytes)) {
      ++found;
      if (std::find(messages.begin(), messages.end(), one.message) == messages.end()) ++wrong;
    }
  }
  EXPECT_GT(found, 2000U);
  EXPECT_GT(decoder.damaged_frames(), 1000U);
  EXPECT_LE(wrong, 2U + decoder.damaged_frames() / 16384);
}

}  // namespace
}  // namespace roslam::telemetry
