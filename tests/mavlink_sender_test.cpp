// SPDX-License-Identifier: BSD-3-Clause
// The sender against a stand-in autopilot, and against links that do not work.
#include "telemetry/mavlink/mavlink_sender.hpp"

#include <gtest/gtest.h>
#include <pty.h>

#include <functional>
#include <thread>

#include "roslam/common/error.hpp"
#include "tests/stand_in_autopilot.hpp"

namespace roslam::telemetry {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

// A frame of a flight at 30 images a second; the camera's clock is not this computer's.
TrackingReport frame(int index, std::optional<std::size_t> resets, Clock::time_point begun) {
  TrackingReport report;
  report.timestamp = 1.7e9 + index / 30.0;
  report.received = begun + std::chrono::microseconds(index * std::int64_t{1'000'000} / 30);
  report.submap = SubmapId{0};
  report.state = resets ? TrackingState::kTracking : TrackingState::kRecentlyLost;
  if (!resets) report.no_pose = NoPose::kFewLandmarks;
  if (!resets) return report;
  Odometry odometry;
  odometry.timestamp = report.timestamp;
  odometry.T_odom_body = SE3(Eigen::Quaterniond::Identity(), {0.01 * index, 0.02 * index, 0.0});
  odometry.covariance = odometry.velocity_covariance = 1e-4 * Matrix6d::Identity();
  odometry.quality = 0.9;
  odometry.resets = *resets;
  report.odometry = odometry;
  return report;
}

// Four seconds: 40 frames, 20 without a pose, 60 after a reset.
TEST(MavlinkSender, TellsAnAutopilotOfAFlightWithALoss) {
  const StandInAutopilot autopilot;
  MavlinkSenderOptions options;
  options.origin = GeodeticOrigin{47.3977, 8.5456, 488.0};
  std::vector<ClosedLoop> loops;
  std::mutex mutex;
  MavlinkSender sender(MavlinkAddress::from(autopilot.address()), options, [&] {
    const std::scoped_lock lock(mutex);
    return loops;
  });
  const auto begun = Clock::now();
  for (int i = 0; i < 120; ++i) {
    std::this_thread::sleep_until(begun + milliseconds(i * 1000 / 30));
    sender.add(frame(i,
                     i < 40   ? std::optional<std::size_t>(0)
                     : i < 60 ? std::nullopt
                              : std::optional<std::size_t>(1),
                     begun));
    if (i != 80) continue;
    const std::scoped_lock lock(mutex);
    loops.push_back({KeyframeId{9}, KeyframeId{1}, 0.284, 0.01, 50, false});
  }
  EXPECT_TRUE(comes([&] {
    return autopilot.all<GpsOriginMessage>().size() == 3 && autopilot.all<StatusTextMessage>().size() >= 4 &&
           autopilot.all<TimesyncMessage>().size() >= 20;
  }));
  sender.finish();
  EXPECT_TRUE(comes([&] { return autopilot.all<StatusTextMessage>().size() == 5; }));

  // TIMESYNC: the clock of time_usec, as the other side finds it.
  EXPECT_LT(std::abs(autopilot.offset()), 20'000'000) << "ns";
  const auto poses = autopilot.all<OdometryMessage>();
  ASSERT_EQ(poses.size(), 100U);
  const double first = static_cast<double>(begun.time_since_epoch() / std::chrono::microseconds(1));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const int index = static_cast<int>(i < 40 ? i : i + 20);
    EXPECT_NEAR(static_cast<double>(poses[i].time_usec), first + index * 1e6 / 30.0, 100.0);
    EXPECT_NEAR(poses[i].position[1], -0.02 * index, 1e-5);  // each once, in order, to the right
    EXPECT_EQ(poses[i].reset_counter, i < 40 ? 0 : 1);
    EXPECT_EQ(poses[i].quality, 90);
    if (i > 0 && i != 40) {
      EXPECT_LE(poses[i].time_usec - poses[i - 1].time_usec, 200'000U);
    }
  }
  // None is late by more than a busy machine explains, none from the future.
  for (const auto& one : autopilot.heard()) {
    const auto* pose = std::get_if<OdometryMessage>(&one.message.message);
    if (pose != nullptr) {
      EXPECT_GE(one.time / 1000 + 1000, static_cast<std::int64_t>(pose->time_usec));
    }
    EXPECT_EQ(one.message.sender, (MavlinkId{1, 197}));
  }
  const auto heartbeats = autopilot.all<HeartbeatMessage>();
  EXPECT_GE(heartbeats.size(), 3U);
  for (const auto& heartbeat : heartbeats) EXPECT_EQ(heartbeat.type, 18);
  const auto origin = autopilot.all<GpsOriginMessage>().front();
  EXPECT_EQ(origin.latitude, 473977000);
  EXPECT_EQ(origin.altitude, 488000);
  EXPECT_EQ(origin.target_system, 1);
  std::vector<std::string> texts;
  for (const auto& text : autopilot.all<StatusTextMessage>()) texts.emplace_back(text.words());
  EXPECT_EQ(texts, (std::vector<std::string>{
                       "RO-SLAM: tracking, reset counter 0", "RO-SLAM: lost, too few landmarks agree",
                       "RO-SLAM: tracking again, reset counter 1",
                       "RO-SLAM: loop closed, map moved by 0.28 m", "RO-SLAM: run ended"}));
  const MavlinkReport report = sender.report();
  EXPECT_EQ(report.stream.odometry, 100U);
  EXPECT_EQ(report.dropped, 0U);
  EXPECT_EQ(report.sent, autopilot.heard().size());
  EXPECT_EQ(report.autopilot, 1);
  EXPECT_GE(report.timesync_answered, 20U);
  EXPECT_EQ(report.from_pose.count, 100U);
  EXPECT_TRUE(sender.take_warnings().empty());
  sender.add(frame(200, 1, begun));  // ignored
  EXPECT_EQ(sender.report().stream.odometry, 100U);
}

TEST(MavlinkSender, TellsOfACameraThatIsLost) {
  const StandInAutopilot autopilot;
  MavlinkSenderOptions options;
  options.camera_silence = milliseconds(200);
  MavlinkSender sender(MavlinkAddress::from(autopilot.address()), options);
  const auto text = [&](std::size_t at) {
    const auto texts = autopilot.all<StatusTextMessage>();
    return at < texts.size() ? std::string(texts[at].words()) : "";
  };
  sender.add(frame(0, 0, Clock::now()));
  EXPECT_TRUE(comes([&] { return text(1).substr(0, 22) == "RO-SLAM: no images for"; })) << text(1);
  EXPECT_TRUE(comes([&] {
    const auto heartbeats = autopilot.all<HeartbeatMessage>();
    return !heartbeats.empty() && heartbeats.back().system_status == 5;  // critical
  }));
  EXPECT_EQ(autopilot.all<OdometryMessage>().size(), 1U);  // silence
  sender.add(frame(90, 1, Clock::now()));
  EXPECT_TRUE(comes([&] { return text(2) == "RO-SLAM: images again"; }));
  EXPECT_TRUE(comes([&] { return autopilot.all<OdometryMessage>().size() == 2; }));
}

bool is_warned(MavlinkSender& sender, const std::string& of) {
  std::string all;
  const bool is_said = comes([&] {
    for (const std::string& warning : sender.take_warnings()) all += warning + "\n";
    return all.find(of) != std::string::npos;
  });
  EXPECT_TRUE(is_said) << all;
  return is_said;
}

TEST(MavlinkSender, WarnsOfAnAutopilotThatNeverAnswers) {
  const StandInAutopilot deaf(false);
  MavlinkSenderOptions options;
  options.autopilot_silence = milliseconds(300);
  MavlinkSender sender(MavlinkAddress::from(deaf.address()), options);
  sender.add(frame(0, 0, Clock::now()));
  EXPECT_TRUE(is_warned(sender, "no autopilot is heard; check host and port"));
  EXPECT_TRUE(comes([&] { return deaf.all<OdometryMessage>().size() == 1; }));  // sent all the same
  EXPECT_FALSE(sender.report().autopilot);
}

// Another ground station or companion is no autopilot, a TIMESYNC for somebody else is not answered.
TEST(MavlinkSender, AnswersOnlyWhatIsMeantForIt) {
  const int socket_of_other = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof(at);
  ASSERT_EQ(bind(socket_of_other, reinterpret_cast<sockaddr*>(&at), size), 0);
  getsockname(socket_of_other, reinterpret_cast<sockaddr*>(&at), &size);
  MavlinkSender sender(MavlinkAddress::from("udp:127.0.0.1:" + std::to_string(ntohs(at.sin_port))), {});
  std::uint8_t bytes[512];
  sockaddr_in from{};
  size = sizeof(from);
  ASSERT_GT(recvfrom(socket_of_other, bytes, sizeof(bytes), 0, reinterpret_cast<sockaddr*>(&from), &size), 0);
  const auto say = [&](const MavlinkMessage& message, MavlinkId id) {
    const auto sent = encode(message, id, 0);
    sendto(socket_of_other, sent.data(), sent.size(), 0, reinterpret_cast<sockaddr*>(&from), sizeof(from));
  };
  say(HeartbeatMessage{}, {255, 190});
  say(TimesyncMessage{5, 6, 0, 0}, {1, 1});      // an answer
  say(TimesyncMessage{0, 6, 7, 0}, {1, 1});      // for another system
  say(TimesyncMessage{0, 6, 1, 191}, {1, 1});    // for another component
  say(TimesyncMessage{0, 6, 1, 197}, {1, 197});  // an echo
  const std::uint8_t garbage[] = {0xfd, 0xff, 0, 0, 1, 2, 3};
  sendto(socket_of_other, garbage, sizeof(garbage), 0, reinterpret_cast<sockaddr*>(&from), sizeof(from));
  say(TimesyncMessage{0, 66, 1, 197}, {1, 1});
  EXPECT_TRUE(comes([&] { return sender.report().timesync_answered > 0; }));
  EXPECT_EQ(sender.report().timesync_answered, 1U);
  EXPECT_EQ(sender.report().received, 5U);
  EXPECT_FALSE(sender.report().autopilot);
  close(socket_of_other);
}

// A port that nobody reads: frames go in as fast as they come, messages are dropped and counted.
TEST(MavlinkSender, IsNotHeldUpByAPortThatIsFull) {
  int master = -1, slave = -1;
  char device[256];
  ASSERT_EQ(openpty(&master, &slave, device, nullptr, nullptr), 0);
  MavlinkSender sender(MavlinkAddress::from("serial:" + std::string(device) + ":57600"), {});
  EXPECT_TRUE(is_warned(sender, "the port carries 5.8: poses will be dropped; use 115200 baud or more"));
  constexpr int kFrames = 3000;
  const auto begun = Clock::now();
  for (int i = 0; i < kFrames; ++i) sender.add(frame(i, 0, begun));
  sender.finish();
  const MavlinkReport report = sender.report();
  EXPECT_GT(report.dropped + report.frames_dropped, 1000U);
  EXPECT_EQ(report.stream.odometry + report.frames_dropped, static_cast<std::size_t>(kFrames));
  EXPECT_EQ(report.link_losses, 0U);
  close(slave);
  close(master);
}

TEST(MavlinkSender, GoesOnWhenTheDeviceVanishes) {
  int master = -1, slave = -1;
  char device[256];
  ASSERT_EQ(openpty(&master, &slave, device, nullptr, nullptr), 0);
  MavlinkSender sender(MavlinkAddress::from("serial:" + std::string(device) + ":921600"), {});
  const auto begun = Clock::now();
  sender.add(frame(0, 0, begun));
  EXPECT_TRUE(comes([&] { return sender.report().from_pose.count == 1; }));
  close(slave);
  close(master);
  EXPECT_TRUE(is_warned(sender, "the link is lost: "));
  sender.add(frame(1, 0, begun));
  EXPECT_TRUE(comes([&] { return sender.report().odometry_dropped == 1; }));
  EXPECT_EQ(sender.report().link_losses, 1U);
}

TEST(MavlinkSender, ChecksItsOptions) {
  const MavlinkAddress address = MavlinkAddress::from("udp:127.0.0.1:9");
  MavlinkSenderOptions options;
  options.id.system = 0;
  EXPECT_THROW(MavlinkSender(address, options), OptionsError);
  options = {};
  options.stream.rate = 1000.0;
  EXPECT_THROW(MavlinkSender(address, options), OptionsError);
  options = {};
  options.camera_silence = milliseconds(1);
  EXPECT_THROW(MavlinkSender(address, options), OptionsError);
}

TEST(GeodeticOrigin, IsReadOrRefused) {
  const GeodeticOrigin origin = GeodeticOrigin::from("-47.5,8.25,-3");
  EXPECT_EQ(origin.latitude, -47.5);
  EXPECT_EQ(origin.longitude, 8.25);
  EXPECT_EQ(origin.altitude, -3.0);
  for (const char* text :
       {"", "1,2", "1,2,3,4", "91,0,0", "0,181,0", "0,0,20000", "nan,0,0", "1, 2,3", "a,b,c"})
    EXPECT_THROW(GeodeticOrigin::from(text), InputError) << text;
}

}  // namespace
}  // namespace roslam::telemetry
