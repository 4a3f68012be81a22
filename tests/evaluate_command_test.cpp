// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "roslam/geometry/trajectory.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class EvaluateTrajectory : public testing::Test {
 protected:
  const fs::path folder_ = scratch_path();

  void SetUp() override {
    fs::remove_all(folder_);
    for (const auto* name : {"sequence", "run-1", "run-2", "run-3"}) fs::create_directories(folder_ / name);
    write_trajectory(folder_ / "sequence/groundtruth.txt", wave(0.0, 0.0));
    write_trajectory(folder_ / "run-1/trajectory.txt", wave(0.01, 0.0));
    write_trajectory(folder_ / "run-2/trajectory.txt", wave(0.03, 0.0));
    write_trajectory(folder_ / "run-3/trajectory.txt", wave(0.02, 0.0));
    write_trajectory(folder_ / "other.txt", wave(0.1, 0.0));
    write_trajectory(folder_ / "late.txt", wave(0.0, 1000.0));
  }
  void TearDown() override { fs::remove_all(folder_); }

  // A rectangle whose corners lift and sink by h in turn: no alignment helps, so the absolute error is h.
  static Trajectory wave(double h, double time) {
    Trajectory trajectory;
    for (int i = 0; i < 80; ++i) {
      const int corner = i % 4;
      const double z = corner % 2 == 0 ? h : -h;
      const Eigen::Vector3d position(corner == 1 || corner == 2 ? 2.0 : 0.0, corner >= 2 ? 1.0 : 0.0, z);
      trajectory.push_back({time + 0.1 * i, SE3(Eigen::Quaterniond::Identity(), position)});
    }
    return trajectory;
  }

  Outcome run(const std::string& arguments, const fs::path& to = "") const {
    const fs::path out = to.empty() ? folder_ / "stdout" : to;
    const fs::path error = folder_ / "stderr";
    const std::string command = "cd '" + folder_.string() + "' && '" ROSLAM_PROGRAM "' evaluate " +
                                arguments + " >'" + out.string() + "' 2>'" + error.string() + "'";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, to.empty() ? content(out) : "", content(error)};
  }
};

TEST_F(EvaluateTrajectory, PrintsATableThatNamesTheRunByItsFolder) {
  const auto result = run("trajectory --truth sequence --estimate run-1");
  EXPECT_EQ(result.code, 0) << result.error;
  EXPECT_NE(result.out.find("| run-1 "), std::string::npos) << result.out;
  EXPECT_NE(result.out.find(" 0.0100 |"), std::string::npos) << result.out;
  EXPECT_EQ(result.error, "");
}

TEST_F(EvaluateTrajectory, PrintsOneJsonObjectWithRunsMedianAndOthers) {
  const auto result =
      run("trajectory --truth sequence --estimate run-1 run-2 --estimate run-3/trajectory.txt "
          "--against 'another system=other.txt' --json");
  ASSERT_EQ(result.code, 0) << result.error;
  const json report = json::parse(result.out);
  ASSERT_EQ(report["estimates"].size(), 3u);
  ASSERT_EQ(report["against"].size(), 1u);
  EXPECT_EQ(report["estimates"][2]["name"], "run-3");
  EXPECT_EQ(report["against"][0]["name"], "another system");
  EXPECT_NEAR(report["median"]["ate_rmse_m"].get<double>(), 0.02, 1e-6);
  EXPECT_NEAR(report["against"][0]["ate_m"]["rmse"].get<double>(), 0.1, 1e-6);
  EXPECT_NEAR(report["estimates"][0]["ate_m"]["max"].get<double>(), 0.01, 1e-6);
  EXPECT_EQ(report["estimates"][0]["pairs"], 80);
  EXPECT_EQ(report["estimates"][0]["wrong_frames"], 0);
  EXPECT_GT(report["against"][0]["wrong_frames"].get<int>(), 0);
  EXPECT_EQ(report["against"][0]["wrong"].size(), report["against"][0]["wrong_frames"].get<std::size_t>());
  EXPECT_EQ(report["alignment"], "se3");
  EXPECT_NEAR(report["estimates"][0]["rpe_frame"]["translation_m"]["rmse"].get<double>(), 0.02, 1e-6);
}

TEST_F(EvaluateTrajectory, AlignsWithScaleOnRequest) {
  Trajectory half;
  for (const auto& [time, pose] : wave(0.0, 0.0))
    half.push_back({time, SE3(pose.rotation(), 0.5 * pose.translation())});
  write_trajectory(folder_ / "half.txt", half);
  const auto result = run("trajectory --truth sequence --estimate half.txt --scale --json");
  ASSERT_EQ(result.code, 0) << result.error;
  const json report = json::parse(result.out);
  EXPECT_EQ(report["alignment"], "sim3");
  EXPECT_NEAR(report["estimates"][0]["scale"].get<double>(), 2.0, 1e-6);
  EXPECT_NEAR(report["median"]["ate_rmse_m"].get<double>(), 0.0, 1e-6);
}

TEST_F(EvaluateTrajectory, DrawsAFigureAndPrintsTheSameEachTime) {
  const std::string arguments = "trajectory --truth sequence --estimate run-1 run-2 --plot figure.png";
  const auto first = run(arguments);
  ASSERT_EQ(first.code, 0) << first.error;
  const std::string bytes = content(folder_ / "figure.png");
  EXPECT_FALSE(cv::imread((folder_ / "figure.png").string()).empty());
  EXPECT_EQ(run(arguments).out, first.out);
  EXPECT_EQ(content(folder_ / "figure.png"), bytes);
}

TEST_F(EvaluateTrajectory, NotesLinesLeftOut) {
  std::ofstream(folder_ / "run-1/trajectory.txt", std::ios::app) << "99 nan 0 0 0 0 0 1\n";
  const auto result = run("trajectory --truth sequence --estimate run-1 --json");
  ASSERT_EQ(result.code, 0) << result.error;
  EXPECT_NE(result.error.find("1 lines left out"), std::string::npos) << result.error;
  EXPECT_EQ(json::parse(result.out)["estimates"][0]["skipped_lines"], 1);
}

TEST_F(EvaluateTrajectory, ExitsWithOneAndOneLineOnBadInput) {
  std::ofstream(folder_ / "broken.txt") << "1 2 3\n";
  std::ofstream(folder_ / "two.txt") << "0 0 0 0 0 0 0 1\n0.1 0 0 0 0 0 0 1\n";
  const std::string truth = "trajectory --truth sequence --estimate ";
  for (const auto& [arguments, words] : std::vector<std::pair<std::string, std::string>>{
           {truth + "missing.txt", "missing.txt"},
           {truth + "sequence", "no trajectory.txt"},
           {truth + "broken.txt", "broken.txt:1:"},
           {truth + "two.txt", "only 2 poses"},
           {truth + "late.txt", "1000.000 to 1007.900 s"},
           {truth + "run-1 --against late.txt", "late.txt"},
           {"trajectory --truth . --estimate run-1", "groundtruth.txt"},
           {truth + "run-1 --plot no/such/folder/figure.png", "folder"},
           {truth + "run-1 --plot figure.xyz", ".png"}}) {
    const auto result = run(arguments);
    EXPECT_EQ(result.code, 1) << arguments;
    EXPECT_NE(result.error.find(words), std::string::npos) << arguments << " -> " << result.error;
    EXPECT_EQ(std::count(result.error.begin(), result.error.end(), '\n'), 1) << result.error;
    EXPECT_EQ(result.out, "") << arguments;
  }
}

TEST_F(EvaluateTrajectory, ExitsWithOneIfTheReportCannotBeWritten) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  const auto result = run("trajectory --truth sequence --estimate run-1", "/dev/full");
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.error.find("stdout"), std::string::npos) << result.error;
}

TEST_F(EvaluateTrajectory, ExitsWithTwoOnWrongUsage) {
  const std::string good = "trajectory --truth sequence --estimate run-1 ";
  for (const std::string& arguments :
       {std::string(), std::string("trajectory"), std::string("trajectory --truth sequence"),
        std::string("nonsense"), good + "--unknown", good + "--max-time-difference 0",
        good + "--max-time-difference nan", good + "--max-time-difference soon", good + "--view sideways"}) {
    EXPECT_EQ(run(arguments).code, 2) << arguments;
  }
}

TEST_F(EvaluateTrajectory, HelpTeachesByExample) {
  const auto result = run("trajectory --help");
  EXPECT_EQ(result.code, 0);
  for (const auto* words : {"--truth", "--estimate", "--against", "Examples:", "Exit code"}) {
    EXPECT_NE(result.out.find(words), std::string::npos) << words;
  }
}

}  // namespace
}  // namespace roslam
