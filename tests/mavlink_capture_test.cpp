// SPDX-License-Identifier: BSD-3-Clause
// A part of what was sent in a simulated flight with a loss, a recovery and a closed loop, against what
// another implementation decoded of it. tests/mavlink_peer.mjs says how both files are made.
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "tests/decoded_mavlink.hpp"
#include "tests/program.hpp"

namespace roslam::telemetry {
namespace {

class MavlinkCapture : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path folder = ROSLAM_TEST_FILES;
    for (const char byte : content(folder / "mavlink_flight.bin"))
      bytes_.push_back(static_cast<std::uint8_t>(byte));
    decoded_ = messages_from(nlohmann::json::parse(content(folder / "mavlink_flight.json")), bytes_.size());
    ASSERT_GT(decoded_.size(), 40U);
  }

  std::vector<std::uint8_t> bytes_;
  std::vector<ReceivedMessage> decoded_;  // by the other implementation
};

TEST_F(MavlinkCapture, IsDecodedToTheSameMessages) {
  MavlinkDecoder decoder;
  const std::vector<ReceivedMessage> own = decoder.add(bytes_);
  EXPECT_EQ(decoder.damaged_frames(), 0U);
  ASSERT_EQ(own.size(), decoded_.size());
  for (std::size_t i = 0; i < own.size(); ++i) {
    EXPECT_EQ(own[i].sender, decoded_[i].sender) << i;
    EXPECT_EQ(own[i].sequence, decoded_[i].sequence) << i;
    EXPECT_EQ(own[i].message, decoded_[i].message) << i;
  }
}

TEST_F(MavlinkCapture, IsEncodedToTheSameBytes) {
  std::vector<std::uint8_t> bytes;
  for (const ReceivedMessage& one : decoded_)
    for (const std::uint8_t byte : encode(one.message, one.sender, one.sequence)) bytes.push_back(byte);
  EXPECT_EQ(bytes, bytes_);
}

TEST_F(MavlinkCapture, HasEveryKindOfMessage) {
  std::set<std::size_t> kinds;
  std::set<int> states, counters;
  std::string texts;
  bool is_after_loop = false;
  for (const ReceivedMessage& one : decoded_) {
    kinds.insert(one.message.index());
    if (const auto* heartbeat = std::get_if<HeartbeatMessage>(&one.message))
      states.insert(heartbeat->system_status);
    if (const auto* pose = std::get_if<OdometryMessage>(&one.message)) {
      counters.insert(pose->reset_counter);
      is_after_loop |= texts.find("loop closed") != std::string::npos;
    }
    if (const auto* text = std::get_if<StatusTextMessage>(&one.message))
      texts += std::string(text->words()) + "\n";
  }
  EXPECT_EQ(kinds.size(), std::variant_size_v<MavlinkMessage>);
  EXPECT_EQ(states, (std::set<int>{3, 4, 5})) << "standby, active, critical";
  EXPECT_GE(counters.size(), 2U);
  EXPECT_TRUE(is_after_loop);
  for (const char* part : {"tracking, ", "lost, ", "tracking again, ", "loop closed, ", "run ended"})
    EXPECT_NE(texts.find("RO-SLAM: " + std::string(part)), std::string::npos) << texts;
}

}  // namespace
}  // namespace roslam::telemetry
