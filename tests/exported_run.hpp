// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "roslam/geometry/trajectory.hpp"
#include "roslam/recordings/recording.hpp"
#include "tests/cdr_message.hpp"
#include "tests/program.hpp"
#include "tests/recorded_messages.hpp"

namespace roslam {

namespace fs = std::filesystem;

/// A short flight over a street with moving cars, recorded to `data` and run to `run`, once for all cases of
/// a program. Each case works in a copy of the run of its own, `copy`.
class ExportedRun : public testing::Test {
 protected:
  static constexpr std::size_t kFrames = 12;

  static void SetUpTestSuite() {
    folder_ = fs::path(testing::TempDir()) / ("roslam_exported_run_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    ASSERT_EQ(roslam("simulate street --frames 12 --traffic light --out data").code, 0);
    const Outcome run =
        roslam("run data --camera data/camera.yaml --mount 0.1,0.02,-0.05,0,20,3 --quiet --out run");
    ASSERT_EQ(run.code, 0) << run.error;
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  void SetUp() override {
    for (const char* name : {"copy", "x.mcap", "x.mcap.part"}) fs::remove_all(folder_ / name);
    fs::copy(folder_ / "run", folder_ / "copy", fs::copy_options::recursive);
  }

  static Outcome roslam(const std::string& arguments) {
    return shell_in(folder_, "'" ROSLAM_PROGRAM "' " + arguments);
  }

  /// Exports the copy to x.mcap.
  static Outcome exported(const std::string& options = "") {
    return roslam("export copy --mcap x.mcap --quiet " + options);
  }

  struct Stamped {
    std::int64_t time;
    std::string data;
  };
  using Topics = std::map<std::string, std::vector<Stamped>>;

  static Topics topics_of(const fs::path& file) {
    Topics topics;
    for (auto& message : read_all(*open_recording(file)))
      topics[message.topic].push_back({message.time, std::move(message.data)});
    return topics;
  }
  static Topics topics() { return topics_of(folder_ / "x.mcap"); }

  /// Exports the copy, which has to succeed, and reads the messages.
  static Topics topics_with(const std::string& options = "") {
    const Outcome outcome = exported(options);
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return outcome.code == 0 ? topics() : Topics();
  }

  static void rewrite(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_ / "copy" / name, std::ios::binary | std::ios::trunc) << bytes;
  }

  /// Changes run.json of the copy.
  template <typename Change>
  static void change_report(const Change& change) {
    auto json = nlohmann::json::parse(content(folder_ / "copy/run.json"));
    change(json);
    rewrite("run.json", json.dump());
  }

  /// The path message: its poses with their times.
  static Trajectory path_of(const std::string& data, const std::string& frame) {
    CdrMessage message(data);
    message.stamp();
    EXPECT_EQ(message.text(), frame);
    Trajectory path(message.get<std::uint32_t>());
    for (StampedPose& pose : path) {
      pose.timestamp = static_cast<double>(message.stamp()) * 1e-9;
      EXPECT_EQ(message.text(), frame);
      pose.T_world_camera = message.pose();
    }
    EXPECT_TRUE(message.is_at_end());
    return path;
  }

  /// The transforms of a message by "parent child".
  static std::map<std::string, SE3> transforms_of(const Stamped& message) {
    CdrMessage in(message.data);
    std::map<std::string, SE3> transforms;
    const auto count = in.get<std::uint32_t>();
    for (std::uint32_t i = 0; i < count; ++i) {
      EXPECT_EQ(in.stamp(), message.time);
      const std::string parent = in.text();
      const std::string child = in.text();
      transforms[parent + " " + child] = in.pose();
    }
    EXPECT_TRUE(in.is_at_end());
    return transforms;
  }

  /// The largest difference of a coordinate or of the rotation's matrix.
  static double difference(const SE3& a, const SE3& b) {
    return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
  }

  static inline fs::path folder_;
};

}  // namespace roslam
