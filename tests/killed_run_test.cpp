// SPDX-License-Identifier: BSD-3-Clause
// A program that is killed, or whose disk is full, leaves what it had found.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <random>
#include <sstream>
#include <thread>

#include "recording/flight_log.hpp"
#include "recording/odometry_file.hpp"
#include "roslam/common/appended_file.hpp"
#include "roslam/common/error.hpp"
#include "roslam/dense/surface_file.hpp"
#include "roslam/map_io/map_file.hpp"
#include "tests/file_size_limit.hpp"
#include "tests/street_frames.hpp"

namespace roslam::street {
namespace {

using namespace recording;
using Clock = std::chrono::steady_clock;

std::vector<std::vector<std::string>> rows_of(const fs::path& csv) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream text(content(csv));
  for (std::string line; std::getline(text, line);) {
    std::vector<std::string> row(1);
    for (const char c : line) {
      if (c == ',') {
        row.emplace_back();
      } else {
        row.back() += c;
      }
    }
    rows.push_back(row);
  }
  return rows;
}

pid_t start(const std::vector<std::string>& arguments) {
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  std::vector<std::string> words{"roslam"};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (auto& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  pid_t process = -1;
  EXPECT_EQ(posix_spawn(&process, ROSLAM_PROGRAM, &files, nullptr, pointers.data(), environ), 0);
  posix_spawn_file_actions_destroy(&files);
  return process;
}

class KilledRun : public Dataset {};

// In real time. Frames come all the time, and what was found is written at least every second: nothing older
// than that is missing.
TEST_F(KilledRun, LosesASecondAtMostAtAnyMoment) {
  make(kBeforeGap);
  for (std::size_t i = 0; i < colour_.size(); ++i) {  // a slow camera, so that a busy computer keeps up
    colour_[i].time = std::to_string(4.0 * std::stod(colour_[i].time));
    depth_[i].time = std::to_string(4.0 * std::stod(depth_[i].time));
  }
  write_lists();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> moment(0.0, 2.5);
  int with_map = 0;
  for (int i = 0; i < 20; ++i) {
    const fs::path run = scratch_ / ("run" + std::to_string(i));
    const pid_t process =
        start({"run", data_.string(), "--camera", "simulated", "--dynamic", "none", "--no-dense",
               "--real-time", "--checkpoint", "0.3", "--quiet", "--out", run.string()});
    const fs::path odometry = run / "odometry.csv";
    const auto begun = Clock::now();
    while (!fs::exists(odometry) || rows_of(odometry).size() < 3) {
      ASSERT_LT(Clock::now() - begun, std::chrono::seconds(60)) << "nothing was written in a minute";
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(moment(random)));
    const auto killed = fs::file_time_type::clock::now();
    kill(process, SIGKILL);
    int status = 0;
    ASSERT_EQ(waitpid(process, &status, 0), process);
    ASSERT_TRUE(WIFSIGNALED(status)) << "it ended before";
    for (const char* file : {"odometry.csv", "trajectory.txt"})
      EXPECT_LT(killed - fs::last_write_time(run / file), std::chrono::milliseconds(1500)) << file;
    auto rows = rows_of(odometry);
    const std::size_t columns = rows.front().size();
    if (rows.back().size() != columns) rows.pop_back();  // cut off in the middle of a line
    for (const auto& row : rows) ASSERT_EQ(row.size(), columns);
    const Trajectory path = read_trajectory(run / "trajectory.txt").trajectory;
    EXPECT_LT(std::abs(path.back().timestamp - std::stod(rows.back()[0])), 1.0);
    EXPECT_FALSE(nlohmann::json::parse(content(run / "run.json"))["finished"]);
    if (!fs::exists(run / "map.roslam")) continue;
    EXPECT_GT(load_map(run / "map.roslam").map.keyframe_count(), 0U);
    ++with_map;
  }
  EXPECT_GT(with_map, 5);
}

class Killed : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(scratch_); }
  void TearDown() override { fs::remove_all(scratch_); }

  const fs::path scratch_ = scratch_path();
};

TEST_F(Killed, ARunIsTakenUpAgain) {
  const fs::path run = scratch_ / "run";
  const std::vector<std::string> flight{"run",  "simulated:street", "--traffic", "none", "--dynamic",
                                        "none", "--no-dense",       "--frames",  "60",   "--quiet"};
  const auto fly = [&](const std::vector<std::string>& further, int signal) {
    auto arguments = flight;
    arguments.insert(arguments.end(), further.begin(), further.end());
    const pid_t process = start(arguments);
    if (signal != 0) {
      for (int i = 0; i < 3000 && !fs::exists(run / "map.roslam"); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      kill(process, signal);
    }
    int status = 0;
    EXPECT_EQ(waitpid(process, &status, 0), process);
    return status;
  };
  fly({"--checkpoint", "0.2", "--out", run.string()}, SIGKILL);
  ASSERT_TRUE(fs::exists(run / "map.roslam"));
  const std::string first = content(run / "odometry.csv");
  ASSERT_EQ(fly({"--resume", run.string()}, 0), 0);
  auto report = nlohmann::json::parse(content(run / "run.json"));
  EXPECT_EQ(report["map"]["recognised"], true);
  EXPECT_EQ(report["finished"], true);
  EXPECT_EQ(content(run / "sessions/1/odometry.csv"), first) << "the earlier session is kept";
  const Outcome evaluated = run_program("evaluate odometry --json '" + run.string() + "'", scratch_);
  ASSERT_EQ(evaluated.code, 0) << evaluated.error;
  const auto odometry = nlohmann::json::parse(evaluated.out)["runs"][0];
  EXPECT_EQ(odometry["frames"], report["frames"]["with_pose"]);
  EXPECT_LT(odometry["step_rmse_m"], 0.01);
  EXPECT_LT(odometry["tilt_deg"], 3.0) << "by the mount in run.json";
  ASSERT_EQ(fly({"--resume", run.string()}, 0), 0);
  EXPECT_TRUE(fs::exists(run / "sessions/2/trajectory.txt"));
  EXPECT_EQ(content(run / "sessions/1/odometry.csv"), first);
}

TEST_F(Killed, LinesThatTheDiskDoesNotTakeLeaveNothingAndMayComeLater) {
  AppendedFile file(scratch_ / "lines", "# header\n");
  EXPECT_TRUE(file.append("one\n"));
  {
    const FileSizeLimit limit(20);
    EXPECT_FALSE(file.append("a line that does not fit\n"));
    EXPECT_EQ(content(file.path()), "# header\none\n");
    EXPECT_TRUE(file.append("two\n"));
    EXPECT_THROW(file.replace("a content that does not fit there\n"), OutputError);
  }
  EXPECT_EQ(content(file.path()), "# header\none\ntwo\n");
  EXPECT_TRUE(file.append("a line that does not fit\n"));
  file.replace("# new\n");
  EXPECT_TRUE(file.append("three\n"));
  EXPECT_EQ(content(file.path()), "# new\nthree\n");
}

TEST_F(Killed, EveryLineOfOdometryHasAllColumns) {
  const auto columns = [](const std::string& line) { return std::count(line.begin(), line.end(), ','); };
  const auto expected = columns(odometry_header());
  FrameResult result;
  for (const NoPose reason : {NoPose::kNoMap, NoPose::kNotRecognised, NoPose::kFewLandmarks,
                              NoPose::kUncertain, NoPose::kPoorFit, NoPose::kImplausible}) {
    result.no_pose = reason;
    EXPECT_EQ(columns(odometry_line(result)), expected) << odometry_line(result);
    EXPECT_NE(odometry_line(result).find(describe(reason)), std::string::npos);
  }
  result.odometry = Odometry{};
  EXPECT_EQ(columns(odometry_line(result)), expected);
}

TEST_F(Killed, AFolderThatCannotBeWrittenCostsNoFlight) {
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  const Slam slam(*camera_preset("simulated"), options);
  FlightLog log({scratch_ / "absent", 30.0, true}, slam);
  log.add({});
  log.stop();
  EXPECT_EQ(log.faults().size(), 2U);
  EXPECT_THROW(log.finish(), OutputError);
}

class SavedInFlight : public Street {};

TEST_F(SavedInFlight, ACheckpointThatDoesNotFitLeavesTheOneBefore) {
  const fs::path folder = scratch_path();
  fs::create_directories(folder);
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  Slam slam(*camera_preset("simulated"), options);
  FlightLog log({folder, 0.2, true}, slam);
  const auto wait_for = [&](const auto& condition) {
    for (int i = 0; i < 500 && !condition(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    EXPECT_TRUE(condition());
  };
  for (std::size_t i = 0; i < 10; ++i) log.add(slam.process((*frames_)[i]));
  const fs::path map = folder / "map.roslam";
  wait_for([&] { return fs::exists(map); });
  const std::size_t keyframes = load_map(map).map.keyframe_count();
  {
    const FileSizeLimit limit(20000);
    for (std::size_t i = 10; i < 60; ++i) log.add(slam.process((*frames_)[i]));
    wait_for([&] { return !log.faults().empty(); });
    EXPECT_EQ(load_map(map).map.keyframe_count(), keyframes);
  }
  wait_for([&] { return load_map(map).map.keyframe_count() == slam.map().keyframe_count(); });
  log.stop();
  log.finish();
  EXPECT_EQ(rows_of(folder / "odometry.csv").size(), 61U) << "a header and a line a frame";
  EXPECT_EQ(read_trajectory(folder / "trajectory.txt").trajectory.size(), 60U);
  fs::remove_all(folder);
}

TEST_F(SavedInFlight, TheDenseMapIsSavedWhereItIsAskedFor) {
  const fs::path folder = scratch_path();
  fs::create_directories(folder);
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  Slam slam(*camera_preset("simulated"), options);
  slam.enable_dense_mapping();
  FlightLog log({folder, 0.1, false, true}, slam);
  for (std::size_t i = 0; i < 60 && !fs::exists(folder / "dense.ply"); ++i) {
    log.add(slam.process((*frames_)[i]));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  log.stop();
  ASSERT_TRUE(fs::exists(folder / "dense.ply"));
  EXPECT_FALSE(fs::exists(folder / "map.roslam"));
  EXPECT_GT(read_surface_ply(folder / "dense.ply").points.size(), 1000U);
  EXPECT_TRUE(log.faults().empty());
  fs::remove_all(folder);
}

}  // namespace
}  // namespace roslam::street
