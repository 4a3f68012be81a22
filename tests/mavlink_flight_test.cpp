// SPDX-License-Identifier: BSD-3-Clause
// What an autopilot hears of simulated flights: of the library, and of the program.
#include <gtest/gtest.h>
#include <pty.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "roslam/options/options.hpp"
#include "roslam/slam/run.hpp"
#include "simulation/simulated_source.hpp"
#include "telemetry/mavlink/mavlink_sender.hpp"
#include "tests/blinded_source.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"
#include "tests/stand_in_autopilot.hpp"

namespace roslam::telemetry {
namespace {

namespace fs = std::filesystem;

TEST(MavlinkFlight, IsSilentWhileTheCameraIsBlindAndRaisesTheCounter) {
  const StandInAutopilot autopilot;
  simulation::SimulatorOptions flight;
  flight.traffic = simulation::TrafficLevel::kNone;
  flight.frames = 90;
  simulation::SimulatedSource street(flight);
  simulation::BlindedSource source(street, 40, 55);
  Options slam_options;
  slam_options.dynamic_objects = *options_of_mode("none", slam_options.dynamic_objects);
  slam_options.dense.enabled = false;
  Slam slam(source.camera(), slam_options, Mode::kDeterministic);
  MavlinkSenderOptions options;
  options.stream.mode = Mode::kDeterministic;
  MavlinkSender sender(MavlinkAddress::from(autopilot.address()), options, [&] { return slam.loops(); });
  std::set<std::uint64_t> with_pose;
  std::size_t resets = 0;
  const RunSummary summary = run_slam(source, slam, [&](const Frame& frame, const FrameResult& result) {
    sender.add(TrackingReport(result));
    if (!result.odometry) return;
    with_pose.insert(static_cast<std::uint64_t>(std::llround(frame.timestamp * 1e6)));
    resets = result.odometry->resets;
  });
  EXPECT_FALSE(summary.failure);
  sender.finish();
  EXPECT_GT(resets, 0U);
  EXPECT_GT(with_pose.size(), 60U);
  EXPECT_LE(with_pose.size(), 75U);
  EXPECT_TRUE(comes([&] { return autopilot.heard().size() == sender.report().sent; }));
  const auto poses = autopilot.all<OdometryMessage>();
  ASSERT_EQ(poses.size(), with_pose.size());
  auto time = with_pose.begin();
  for (const OdometryMessage& pose : poses) EXPECT_EQ(pose.time_usec, *time++);
  EXPECT_EQ(poses.front().reset_counter, 0);
  EXPECT_EQ(poses.back().reset_counter, resets % 256);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    EXPECT_NE(poses[i].position, poses[i - 1].position);
    const double gap = 1e-6 * static_cast<double>(poses[i].time_usec - poses[i - 1].time_usec);
    if (gap > 0.2) {
      EXPECT_GT(poses[i].reset_counter, poses[i - 1].reset_counter);
    }
  }
}

class MavlinkProgram : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }

  Outcome roslam(const std::string& arguments) const {
    return shell_in(folder_, std::string(ROSLAM_PROGRAM) + " " + arguments);
  }
  Outcome fly(const std::string& mavlink) const {
    return roslam(
        "run simulated:street --frames 30 --traffic none --dynamic none --no-dense --no-loops "
        "--quiet --out run " +
        mavlink);
  }
  void expect_error(const std::string& mavlink, int code, const std::string& part) const {
    const Outcome outcome = fly(mavlink);
    EXPECT_EQ(outcome.code, code) << outcome.error;
    EXPECT_NE(outcome.error.find(part), std::string::npos) << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    EXPECT_FALSE(fs::exists(folder_ / "run"));
  }

  fs::path folder_ = scratch_path();
};

TEST_F(MavlinkProgram, SendsWhatItCounts) {
  const StandInAutopilot autopilot;
  const Outcome outcome = fly("--mavlink " + autopilot.address() + " --mavlink-id 7,42 --frame map");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.error.find("note: --mavlink without --real-time"), std::string::npos);
  EXPECT_NE(outcome.out.find("30 poses of "), std::string::npos) << outcome.out;
  const auto json = nlohmann::json::parse(content(folder_ / "run" / "run.json"))["mavlink"];
  const auto sent = json["sent"].get<std::size_t>();
  EXPECT_TRUE(comes([&] { return autopilot.heard().size() == sent; }));
  const auto heard = autopilot.heard();
  EXPECT_EQ(heard.size(), sent);
  for (const auto& one : heard) EXPECT_EQ(one.message.sender, (MavlinkId{7, 42}));
  EXPECT_EQ(json["frame"], "map");
  EXPECT_EQ(json["odometry"]["sent"], 30);
  EXPECT_EQ(json["dropped"], 0);
  EXPECT_EQ(autopilot.all<OdometryMessage>().size(), 30U);

  const Outcome checked = roslam("telemetry check run --frame map --json");
  ASSERT_EQ(checked.code, 0) << checked.error;
  const auto check = nlohmann::json::parse(checked.out);
  EXPECT_EQ(check["messages"], 30);
  EXPECT_EQ(check["states"]["tracking"]["frames"], 30);
  EXPECT_NEAR(check["rate_hertz"].get<double>(), 30.0, 0.1);
  EXPECT_EQ(check["resets"], 0);
  EXPECT_TRUE(check["ready"].get<bool>()) << checked.out;
  const Outcome table = roslam("telemetry check run");
  EXPECT_NE(table.out.find("verdict: what PX4 and ArduPilot demand is met"), std::string::npos) << table.out;
}

TEST_F(MavlinkProgram, SaysWhatIsWrongBeforeItFlies) {
  const StandInAutopilot other(false);
  const std::string port = other.address().substr(other.address().rfind(':') + 1);
  expect_error("--mavlink tcp:127.0.0.1:5760", 1, "is neither udp nor serial");
  expect_error("--mavlink udp:127.0.0.1:9:" + port, 1, "port " + port + " is in use");
  expect_error("--mavlink serial:/dev/no-such-device:57600", 1, "no such device");
  expect_error("--mavlink serial:/dev/null:57600", 1, "is no serial port");
  expect_error("--mavlink udp:127.0.0.1:9 --origin 1,2", 1, "is not LAT,LON,ALT");
  expect_error("--mavlink udp:127.0.0.1:9 --mavlink-id 1,300", 1, "is not SYSTEM,COMPONENT");
  expect_error("--origin 1,2,3", 2, "--mavlink");
  expect_error("--send-predicted", 2, "--mavlink");
  expect_error("--mavlink udp:127.0.0.1:9 --frame body", 2, "--frame");
}

TEST_F(MavlinkProgram, WarnsOfAPortThatIsTooSlow) {
  int master = -1, slave = -1;
  char device[256];
  ASSERT_EQ(openpty(&master, &slave, device, nullptr, nullptr), 0);
  const Outcome outcome = fly("--mavlink serial:" + std::string(device) + ":57600");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.error.find("poses will be dropped; use 115200 baud or more"), std::string::npos);
  EXPECT_NE(outcome.out.find("no autopilot heard"), std::string::npos) << outcome.out;
  close(slave);
  close(master);
}

TEST_F(MavlinkProgram, ChecksOnlyRuns) {
  EXPECT_EQ(roslam("telemetry check missing").code, 1);
  EXPECT_EQ(roslam("telemetry").code, 2);
  fs::create_directories(folder_ / "bad");
  std::ofstream(folder_ / "bad" / "odometry.csv") << "1.0,tracking,0,1\n";
  const Outcome outcome = roslam("telemetry check bad");
  EXPECT_EQ(outcome.code, 1);
  EXPECT_NE(outcome.error.find("odometry.csv, line 1"), std::string::npos) << outcome.error;
}

}  // namespace
}  // namespace roslam::telemetry
