// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "tests/benchmark_fixture.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class BenchmarkStatic : public BenchmarkTest {};

TEST_F(BenchmarkStatic, RunsASimulatedFlightTwiceAndReportsIt) {
  const auto result = roslam("benchmark static --frames 20 --runs 2 --out results --json");
  ASSERT_EQ(result.code, 0) << result.error;
  const json report = json::parse(result.out);
  EXPECT_EQ(report, json::parse(content(folder_ / "results/benchmark.json")));
  EXPECT_EQ(report["mode"], "deterministic");
  EXPECT_EQ(report["interrupted"], false);
  EXPECT_FALSE(report["machine"]["processor"].get<std::string>().empty());
  ASSERT_EQ(report["sequences"].size(), 1U);
  const json& sequence = report["sequences"][0];
  EXPECT_EQ(sequence["source"], "simulated:street");
  EXPECT_EQ(sequence["complete_runs"], 2);
  EXPECT_EQ(sequence["repeats"], true);
  ASSERT_EQ(sequence["runs"].size(), 2U);
  const json& median = sequence["median"];
  EXPECT_EQ(median["frames"], 20);
  EXPECT_EQ(median["tracked_share"], 1);
  EXPECT_EQ(median["dropped"], 0);
  EXPECT_LT(median["ate_rmse_m"].get<double>(), 0.05);
  EXPECT_EQ(median["ate_rmse_m"], sequence["runs"][1]["ate_rmse_m"]);
  EXPECT_GT(median["tracking_median_ms"].get<double>(), 0.0);
  EXPECT_GE(median["tracking_p95_ms"], median["tracking_median_ms"]);
  EXPECT_GE(median["keyframes"], 1);
  EXPECT_GT(median["peak_memory_mb"].get<double>(), 10.0);
  EXPECT_GT(median["start_up_s"].get<double>(), 0.0);
  EXPECT_EQ(sequence["stages"]["tracking"]["count"], 20);
}

TEST_F(BenchmarkStatic, WritesMarkdownAndAFigure) {
  const auto result =
      roslam("benchmark static --sequences simulated:hover --frames 10 --runs 1 --out results");
  ASSERT_EQ(result.code, 0) << result.error;
  const std::string markdown = content(folder_ / "results/benchmark.md");
  for (const char* words : {"| simulated-hover ", "ATE RMSE m", "start-up s", "| tracking.extract ",
                            "![Trajectories of simulated-hover](simulated-hover.png)"}) {
    EXPECT_NE(markdown.find(words), std::string::npos) << words << " is not in\n" << markdown;
  }
  EXPECT_FALSE(cv::imread((folder_ / "results/simulated-hover.png").string()).empty());
  EXPECT_NE(result.out.find("| simulated-hover "), std::string::npos) << result.out;
  EXPECT_TRUE(fs::exists(folder_ / "results/runs/simulated-hover-1/trajectory.txt"));
}

TEST_F(BenchmarkStatic, TakesTheCameraFromTheFolderAndLeavesAccuracyOpenWithoutTruth) {
  ASSERT_EQ(roslam("simulate street --frames 10 --out flight").code, 0);
  fs::create_directories(folder_ / "other");
  fs::copy(folder_ / "flight", folder_ / "other/flight", fs::copy_options::recursive);
  fs::remove(folder_ / "other/flight/groundtruth.txt");
  fs::remove(folder_ / "other/flight/camera.yaml");
  const auto result = roslam(
      "benchmark static --sequences flight other/flight:flight/camera.yaml --runs 1 --out results --json");
  ASSERT_EQ(result.code, 0) << result.error;
  const json report = json::parse(result.out);
  ASSERT_EQ(report["sequences"].size(), 2U);
  const json& with_truth = report["sequences"][0];
  const json& without = report["sequences"][1];
  EXPECT_EQ(with_truth["name"], "flight");
  EXPECT_EQ(without["name"], "flight_2");
  EXPECT_TRUE(with_truth["median"]["ate_rmse_m"].is_number());
  EXPECT_TRUE(without["median"]["ate_rmse_m"].is_null());
  EXPECT_EQ(without["median"]["tracked_share"], 1);
  EXPECT_NE(without["runs"][0]["no_accuracy_because"].get<std::string>().find("groundtruth.txt"),
            std::string::npos);
  const std::string markdown = content(folder_ / "results/benchmark.md");
  EXPECT_NE(markdown.find("no accuracy"), std::string::npos) << markdown;
  EXPECT_TRUE(fs::exists(folder_ / "results/flight_2.png"));
}

TEST_F(BenchmarkStatic, WritesWhatThereIsWhenInterrupted) {
  const auto result = shell("{ '" ROSLAM_PROGRAM
                            "' benchmark static --frames 10 --runs 1000 --out results & "
                            "until [ -s results/runs/simulated-street-2/run.json ]; do sleep 0.1; done; "
                            "kill -TERM $!; wait $!; }");
  EXPECT_EQ(result.code, 0) << result.error;
  const json report = json::parse(content(folder_ / "results/benchmark.json"));
  EXPECT_EQ(report["interrupted"], true);
  ASSERT_EQ(report["sequences"].size(), 1U);
  EXPECT_GE(report["sequences"][0]["complete_runs"], 1);
  EXPECT_TRUE(report["sequences"][0]["median"]["ate_rmse_m"].is_number());
  EXPECT_NE(content(folder_ / "results/benchmark.md").find("Interrupted"), std::string::npos);
}

TEST_F(BenchmarkStatic, ExitsWithOneAndOneLineOnBadInput) {
  ASSERT_EQ(roslam("simulate street --frames 3 --out flight").code, 0);
  fs::create_directories(folder_ / "empty");
  std::ofstream(folder_ / "bad.yaml") << "nonsense: 1\n";
  std::ofstream(folder_ / "file") << "not a folder\n";
  for (const auto& [arguments, words] : std::vector<std::pair<std::string, std::string>>{
           {"--sequences missing --out results", "missing: no such folder"},
           {"--sequences flight missing:tum-fr1 --out results", "missing:tum-fr1"},
           {"--sequences simulated:moon --out results", "no such flight"},
           {"--sequences empty --out results", "needs a camera"},
           {"--sequences empty:tum-fr1 --out results", "empty"},
           {"--sequences flight:no-camera --out results", "no-camera"},
           {"--config bad.yaml --out results", "nonsense"},
           {"--out file/results", "--out"}}) {
    expect_refused("benchmark static --runs 1 " + arguments, words);
  }
}

TEST_F(BenchmarkStatic, ReportsTheOtherSequencesWhenOneFails) {
  ASSERT_EQ(roslam("simulate street --frames 3 --out flight").code, 0);
  fs::copy(folder_ / "flight", folder_ / "broken", fs::copy_options::recursive);
  for (const auto& image : fs::directory_iterator(folder_ / "broken/rgb"))
    std::ofstream(image.path()) << "no image";
  const auto result = roslam("benchmark static --sequences broken flight --runs 1 --out results --json");
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.error.find("no frame could be used"), std::string::npos) << result.error;
  const json report = json::parse(content(folder_ / "results/benchmark.json"));
  ASSERT_EQ(report["sequences"].size(), 2U);
  EXPECT_EQ(report["sequences"][0]["complete_runs"], 0);
  EXPECT_TRUE(report["sequences"][0]["runs"][0]["failure"].is_string());
  EXPECT_EQ(report["sequences"][1]["complete_runs"], 1);
}

TEST_F(BenchmarkStatic, ExitsWithTwoOnWrongUsage) {
  for (const char* arguments :
       {"benchmark", "benchmark static", "benchmark nonsense", "benchmark static --out r --runs 0",
        "benchmark static --out r --runs many", "benchmark static --out r --traffic jam",
        "benchmark static --out r --unknown", "benchmark static --out r --sequences"}) {
    EXPECT_EQ(roslam(arguments).code, 2) << arguments;
  }
  EXPECT_FALSE(fs::exists(folder_ / "r"));
}

TEST_F(BenchmarkStatic, HelpTeachesByExample) {
  const auto result = roslam("benchmark static --help");
  EXPECT_EQ(result.code, 0);
  for (const char* words : {"Examples:", ":tum-fr1", "camera.yaml", "--real-time", "Exit code"}) {
    EXPECT_NE(result.out.find(words), std::string::npos) << words;
  }
}

}  // namespace
}  // namespace roslam
