// SPDX-License-Identifier: BSD-3-Clause
// roslam record, roslam camera list, and the options of connected cameras.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "roslam/recordings/recording.hpp"
#include "tests/program.hpp"
#include "tests/recorded_messages.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;

class RecordCommand : public testing::Test {
 protected:
  RecordCommand() : scratch_(scratch_path()) { fs::create_directories(scratch_); }
  Outcome roslam(const std::string& arguments) const {
    return shell_in(scratch_, std::string(ROSLAM_PROGRAM) + " " + arguments);
  }
  std::size_t messages_in(const std::string& file) const {
    return read_all(*open_recording(scratch_ / file)).size();
  }

  fs::path scratch_;
};

constexpr const char* kHover = "simulated:hover --traffic none ";

TEST_F(RecordCommand, WritesARecordingThatGivesTheSameTrajectory) {
  const Outcome outcome = roslam(std::string("record ") + kHover + "--frames 12 --imu --out hover.mcap");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.out.find("frames: 12\n"), std::string::npos) << outcome.out;
  const std::string rest = " --dynamic none --no-dense --no-loops --quiet --out ";
  ASSERT_EQ(roslam("run hover.mcap" + rest + "recorded").code, 0);
  ASSERT_EQ(roslam(std::string("run ") + kHover + "--frames 12 --imu" + rest + "flown").code, 0);
  EXPECT_FALSE(content(scratch_ / "flown/trajectory.txt").empty());
  EXPECT_EQ(content(scratch_ / "recorded/trajectory.txt"), content(scratch_ / "flown/trajectory.txt"));
  EXPECT_EQ(content(scratch_ / "recorded/odometry.csv"), content(scratch_ / "flown/odometry.csv"));
}

TEST_F(RecordCommand, KeepsAnOlderRecording) {
  const std::string record = std::string("record ") + kHover + "--quiet --frames ";
  ASSERT_EQ(roslam(record + "2 --out flight.mcap").code, 0);
  ASSERT_EQ(roslam(record + "4 --out flight.mcap").code, 0);
  EXPECT_LT(messages_in("flight.mcap.1"), messages_in("flight.mcap"));
}

TEST_F(RecordCommand, EndsAfterATime) {
  ASSERT_EQ(roslam(std::string("record ") + kHover + "--quiet --seconds 0.1 --out flight.mcap").code, 0);
  const auto recording = open_recording(scratch_ / "flight.mcap");
  ASSERT_TRUE(recording->time_range());
  EXPECT_NEAR(static_cast<double>(recording->time_range()->second - recording->time_range()->first) * 1e-9,
              0.1, 0.04);
}

// A kill -9 costs the last chunk, and the index.
TEST_F(RecordCommand, LeavesAReadableFileWhenItIsKilled) {
  const std::string command = std::string(ROSLAM_PROGRAM) + " record " + kHover + "--quiet --out killed.mcap";
  shell_in(scratch_, "( " + command +
                         " & process=$!; for i in $(seq 600); do sleep 0.1; "
                         "[ $(stat -c %s killed.mcap 2>/dev/null || echo 0) -gt 3000000 ] && break; done; "
                         "kill -9 $process; wait $process; true )");
  ASSERT_GT(fs::file_size(scratch_ / "killed.mcap"), 3000000U);
  EXPECT_GE(messages_in("killed.mcap"), 5U);
}

TEST_F(RecordCommand, RefusesWhatCannotBe) {
  const auto fails = [&](const std::string& arguments, int code, const std::string& message) {
    const Outcome outcome = roslam(arguments);
    EXPECT_EQ(outcome.code, code) << arguments;
    EXPECT_NE(outcome.error.find(message), std::string::npos) << arguments << ": " << outcome.error;
  };
  ASSERT_EQ(roslam(std::string("record ") + kHover + "--quiet --frames 2 --out flight.mcap").code, 0);
  fails("record flight.mcap --out flight.mcap", 1, "is the source itself");
  fails("record . --out flight.mcap", 1, "in its folder");
  std::ofstream(scratch_ / "letter.txt") << "Dear";
  fails(std::string("record ") + kHover + "--out letter.txt", 2, "file of another kind");
  fails(std::string("record ") + kHover + "--out nowhere/flight.mcap", 1, "nowhere/flight.mcap");
  fails(std::string("record ") + kHover + "--stream 640x480@30 --out a.mcap", 1, "is of a camera");
  fails(std::string("run ") + kHover + "--record a.mcap --out run", 2, "roslam record converts");
  fails("record realsense --camera d435 --out a.mcap", 1, "has its own calibration");
  fails("record missing --camera d435 --out a.mcap", 1, "missing");
  EXPECT_FALSE(fs::exists(scratch_ / "a.mcap"));
}

TEST_F(RecordCommand, SaysWhatIsConnected) {
  const Outcome outcome = roslam("camera list");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  const auto json = nlohmann::json::parse(roslam("camera list --json").out);
  EXPECT_TRUE(json["cameras"].is_array());
  EXPECT_TRUE(json["video_devices"].is_array());
  if (json["realsense_built_in"]) GTEST_SKIP() << "librealsense is built in";
  EXPECT_NE(outcome.out.find("without librealsense"), std::string::npos) << outcome.out;
  EXPECT_EQ(roslam("run realsense --out run").code, 1);
  EXPECT_EQ(roslam("run realsense:1234 --stream 1x --out run").code, 1);
}

}  // namespace
}  // namespace roslam
