// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "roslam/datasets/tum_source.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"

/// Tests on a short flight along the simulated street without traffic. The program record_street renders it
/// once for all tests (a CTest fixture), since that takes longer than the tests: frames 0 to 59 and, after a
/// gap, 85 to 99, at 30 a second.
namespace roslam::street {

namespace fs = std::filesystem;

inline const fs::path kFolder = ROSLAM_TEST_STREET;
constexpr std::size_t kBeforeGap = 60;
constexpr std::size_t kGapEnd = 85;
constexpr std::size_t kEnd = 100;

inline double time_of(std::size_t frame) { return std::round(1e6 * static_cast<double>(frame) / 30.0) / 1e6; }

/// All frames with their true poses; index and time are those in the flight.
inline std::vector<Frame> frames() {
  TumSource source(kFolder, *camera_preset("simulated"));
  const Trajectory truth = read_trajectory(kFolder / "groundtruth.txt").trajectory;
  std::vector<Frame> all;
  while (auto frame = source.next()) {
    frame->T_world_camera = truth.at(all.size()).T_world_camera;
    frame->index = static_cast<std::size_t>(std::lround(30.0 * frame->timestamp));
    all.push_back(std::move(*frame));
  }
  return all;
}

inline void put(const fs::path& file, const std::string& bytes) {
  fs::remove_all(file);  // an existing file may be a link to the recorded image
  std::ofstream(file, std::ios::binary) << bytes;
}

inline void put_image(const fs::path& file, const cv::Mat& image) {
  fs::remove_all(file);
  cv::imwrite(file.string(), image);
}

/// Runs the program and waits for it.
inline Outcome run_program(const std::string& arguments, const fs::path& scratch,
                           const std::string& to = "") {
  const std::string out = to.empty() ? (scratch / "stdout").string() : to;
  const std::string error = (scratch / "stderr").string();
  const int status =
      std::system(("'" ROSLAM_PROGRAM "' " + arguments + " >'" + out + "' 2>'" + error + "'").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, to.empty() ? content(out) : "", content(error)};
}

/// Expects exit code 1 and one line on stderr that contains all these words.
inline void expect_refused(const Outcome& outcome, const std::vector<std::string>& words) {
  EXPECT_EQ(outcome.code, 1) << outcome.error;
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  for (const auto& word : words)
    EXPECT_NE(outcome.error.find(word), std::string::npos) << word << ": " << outcome.error;
}

/// A copy of the first frames of the street in the TUM format, for a test to damage. put() replaces images,
/// write_lists() writes the lists.
class Dataset : public testing::Test {
 protected:
  struct Line {
    std::string time;
    std::string file;
  };

  static constexpr std::size_t kFrames = 10;

  void SetUp() override { make(kFrames); }
  void TearDown() override { fs::remove_all(scratch_); }

  void make(std::size_t frames) {
    fs::remove_all(scratch_);
    colour_.clear();
    depth_.clear();
    for (const char* name : {"rgb", "depth"}) fs::create_directories(data_ / name);
    for (std::size_t i = 0; i < frames; ++i) {
      const std::string time = std::to_string(time_of(i));
      colour_.push_back({time, "rgb/" + time + ".png"});
      depth_.push_back({time, "depth/" + time + ".png"});
      fs::create_hard_link(kFolder / colour_[i].file, data_ / colour_[i].file);
      fs::create_hard_link(kFolder / depth_[i].file, data_ / depth_[i].file);
    }
    write_lists();
  }

  static std::string text_of(const std::vector<Line>& lines, const std::string& line_end = "\n") {
    std::string text = "# timestamp filename" + line_end;
    for (const auto& line : lines) text += line.time + " " + line.file + line_end;
    return text;
  }

  void write_lists() const {
    put(data_ / "rgb.txt", text_of(colour_));
    put(data_ / "depth.txt", text_of(depth_));
  }

  fs::path colour(std::size_t i) const { return data_ / colour_[i].file; }
  fs::path depth(std::size_t i) const { return data_ / depth_[i].file; }

  Outcome run(const std::string& arguments = "", const std::string& camera = "simulated") const {
    return run_program("run '" + data_.string() + "' --quiet --camera '" + camera + "' --out '" +
                           run_.string() + "' " + arguments,
                       scratch_);
  }

  /// Runs, expects success and returns the frame counts of run.json.
  nlohmann::json frames_of_run(const std::string& arguments = "",
                               const std::string& camera = "simulated") const {
    const Outcome outcome = run(arguments, camera);
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    EXPECT_EQ(outcome.error, "");
    return report()["frames"];
  }

  nlohmann::json report() const { return nlohmann::json::parse(content(run_ / "run.json"), nullptr, false); }
  Trajectory trajectory() const { return read_trajectory(run_ / "trajectory.txt").trajectory; }

  const fs::path scratch_ = scratch_path();
  const fs::path data_ = scratch_ / "data";
  const fs::path run_ = scratch_ / "run";
  std::vector<Line> colour_;
  std::vector<Line> depth_;
};

}  // namespace roslam::street
