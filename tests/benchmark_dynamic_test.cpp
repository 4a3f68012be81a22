// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "evaluation/plots/bar_chart.hpp"
#include "roslam/common/error.hpp"
#include "tests/benchmark_fixture.hpp"

namespace roslam {

using namespace evaluation;
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class BenchmarkDynamic : public BenchmarkTest {};

TEST_F(BenchmarkDynamic, RunsEveryModeWithAndWithoutTraffic) {
  const auto result = roslam("benchmark dynamic --frames 5 --runs 1 --out results --json");
  ASSERT_EQ(result.code, 0) << result.error;
  const json report = json::parse(result.out);
  EXPECT_EQ(report, json::parse(content(folder_ / "results/benchmark.json")));
  EXPECT_EQ(report["benchmark"], "dynamic");
  EXPECT_EQ(report["simulation"]["traffic"], "heavy");
  ASSERT_EQ(report["sequences"].size(), 1U);
  const json& sequence = report["sequences"][0];
  EXPECT_EQ(sequence["name"], "simulated-street");
  for (const char* mode : {"none", "labels", "geometry", "both", "ds-slam-like", "dynaslam-like"}) {
    for (const char* kind : {"by_mode", "nothing_moving"}) {
      const json& median = sequence[kind][mode]["median"];
      EXPECT_EQ(median["tracked_share"], 1) << mode;
      EXPECT_LT(median["ate_rmse_m"].get<double>(), 0.05) << mode;
    }
    const bool has_labels = std::string(mode) != "none" && std::string(mode) != "geometry";
    EXPECT_EQ(sequence["by_mode"][mode]["stages"].contains("segmentation"), has_labels) << mode;
    const json run = json::parse(
        content(folder_ / ("results/runs/simulated-street-" + std::string(mode) + "-1/run.json")));
    EXPECT_EQ(run["dynamic"]["mode"], mode);
  }
  EXPECT_FALSE(sequence["removal"].contains("none"));
  ASSERT_TRUE(sequence["removal"].contains("both")) << result.error;
  EXPECT_EQ(sequence["removal"]["both"]["frames"]["compared"], 5);
  // The same flight without its traffic.
  const json still = json::parse(content(folder_ / "results/runs/simulated-street-still-none-1/run.json"));
  EXPECT_EQ(still["frames"]["in_source"], 5);
  EXPECT_NE(sequence["by_mode"]["none"]["median"]["landmarks"],
            sequence["nothing_moving"]["none"]["median"]["landmarks"]);
}

TEST_F(BenchmarkDynamic, WritesTablesAndCharts) {
  const auto result = roslam("benchmark dynamic --frames 4 --runs 2 --modes none both --out results");
  ASSERT_EQ(result.code, 0) << result.error;
  const std::string markdown = content(folder_ / "results/benchmark.md");
  for (const char* words : {"none (ORB-SLAM2-like)", "both (RO-SLAM)", "| simulated-street ",
                            "- static counterpart", "table 3 of the paper", "table 5 of the paper", "137.96",
                            "](bars.png)", "on actors, kept", "](simulated-street.png)", "ratio of ATE"}) {
    EXPECT_NE(markdown.find(words), std::string::npos) << words << " is not in\n" << markdown;
  }
  EXPECT_EQ(markdown.find("| ds-slam-like"), std::string::npos) << "a mode that was not asked for";
  EXPECT_EQ(markdown.find("paper: DS-SLAM"), std::string::npos) << "no sequence of table 3 was run";
  EXPECT_EQ(markdown.find("the runs differ"), std::string::npos) << markdown;
  EXPECT_FALSE(cv::imread((folder_ / "results/bars.png").string()).empty());
  EXPECT_FALSE(cv::imread((folder_ / "results/simulated-street.png").string()).empty());
}

// A simulated sequence with the folder name of one of the TUM benchmark.
TEST_F(BenchmarkDynamic, SetsPublishedFiguresBesideSequencesOfThePaperInItsOrder) {
  for (const char* name : {"walking_xyz", "walking_halfsphere"}) {
    ASSERT_EQ(roslam("simulate street --frames 5 --out tum/rgbd_dataset_freiburg3_" + std::string(name)).code,
              0);
  }
  const auto result = roslam("benchmark dynamic --tum tum --runs 1 --modes none --out results --json");
  ASSERT_EQ(result.code, 0) << result.error;
  const json report = json::parse(result.out);
  ASSERT_EQ(report["sequences"].size(), 2U) << "the street is left out when others are named";
  EXPECT_EQ(report["sequences"][0]["name"], "rgbd_dataset_freiburg3_walking_halfsphere");
  EXPECT_EQ(report["sequences"][1]["name"], "rgbd_dataset_freiburg3_walking_xyz");
  EXPECT_TRUE(report["sequences"][0]["nothing_moving"].is_null());
  const std::string markdown = content(folder_ / "results/benchmark.md");
  std::istringstream lines(markdown);
  int heads = 0;
  int rows = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("| ATE")) {
      ++heads;
      EXPECT_LT(line.find("paper: ORB-SLAM2"), line.find("paper: DS-SLAM"));
      EXPECT_LT(line.find("paper: DynaSLAM"), line.find("paper: RO-SLAM"));
    }
    if (line.starts_with("| rgbd_dataset_freiburg3_walking_xyz")) {
      ++rows;
      std::size_t at = 0;
      for (const char* value : {"0.4590", "0.0151", "0.0150", "0.0146"}) {
        at = line.find(value, at);
        EXPECT_NE(at, std::string::npos) << value << " is not in its place in " << line;
      }
    }
  }
  EXPECT_EQ(heads, 1) << markdown;
  EXPECT_EQ(rows, 1) << markdown;
}

TEST_F(BenchmarkDynamic, RunsTheFramesThatAComposedSequenceWasMadeOf) {
  ASSERT_EQ(roslam("simulate street --traffic none --frames 6 --out base").code, 0);
  fs::create_directories(folder_ / "people");
  cv::imwrite((folder_ / "people/one.png").string(), cv::Mat(200, 80, CV_8UC3, cv::Scalar(0, 255, 0)));
  cv::Mat mask(200, 80, CV_8UC1, cv::Scalar(0));
  mask(cv::Rect(5, 5, 70, 190)) = 255;
  cv::imwrite((folder_ / "people/one_mask.png").string(), mask);
  const auto made = roslam(
      "compose base --camera base/camera.yaml --people people --up 0 0 1 --camera-height 1.6 "
      "--distance 2 3 --span 0.5 --out made");
  ASSERT_EQ(made.code, 0) << made.error;
  const auto result = roslam("benchmark dynamic --sequences made --modes none --runs 1 --out results --json");
  ASSERT_EQ(result.code, 0) << result.error;
  const json sequence = json::parse(result.out)["sequences"][0];
  const json& with = sequence["by_mode"]["none"];
  const json& without = sequence["nothing_moving"]["none"];
  EXPECT_EQ(without["name"], "made-still");
  EXPECT_EQ(without["median"]["frames"], 6);
  // Bit for bit what the base itself gives, read with the units of its own depth.
  ASSERT_EQ(roslam("run base --camera base/camera.yaml --dynamic none --quiet --out alone").code, 0);
  EXPECT_EQ(content(folder_ / "results/runs/made-still-none-1/trajectory.txt"),
            content(folder_ / "alone/trajectory.txt"));
  EXPECT_NE(with["median"]["landmarks"], without["median"]["landmarks"]);
  // A static counterpart given by name takes precedence.
  const auto named = roslam(
      "benchmark dynamic --sequences made made --counterparts base base --modes none --runs 1 --out named "
      "--json");
  ASSERT_EQ(named.code, 0) << named.error;
  const json both = json::parse(named.out)["sequences"];
  EXPECT_EQ(both[0]["nothing_moving"]["none"]["source"], "base");
  // The same static counterpart is not run twice.
  EXPECT_EQ(both[0]["nothing_moving"]["none"]["runs"], both[1]["nothing_moving"]["none"]["runs"]);
  EXPECT_EQ(both[1]["nothing_moving"]["none"]["name"], "made_2-still");
  EXPECT_FALSE(fs::exists(folder_ / "named/runs/made_2-still-none-1"));
  EXPECT_TRUE(fs::exists(folder_ / "named/runs/made_2-none-1"));
}

TEST_F(BenchmarkDynamic, ExitsWithOneLineOnBadInput) {
  ASSERT_EQ(roslam("simulate street --frames 3 --out flight").code, 0);
  fs::create_directories(folder_ / "empty");
  for (const char* name : {"made", "flight-still"})
    fs::copy(folder_ / "flight", folder_ / name, fs::copy_options::recursive);
  std::ofstream(folder_ / "made/background.txt") << "# nothing\n";
  std::ofstream(folder_ / "made/background_depth.txt") << "# nothing\n";
  for (const auto& [arguments, words] : std::vector<std::pair<std::string, std::string>>{
           {"--sequences missing", "missing: no such folder"},
           {"--tum empty", "scripts/get_tum"},
           {"--sequences flight --counterparts flight flight", "--counterparts: 2 for 1"},
           {"--sequences flight --twins flight flight", "--counterparts: 2 for 1"},
           {"--sequences flight --counterparts simulated:street", "--counterparts simulated:street"},
           {"--sequences flight --counterparts empty:tum-fr1", "empty"},
           {"--sequences made", "made/composition.json"},
           {"--sequences flight flight-still --counterparts flight -", "'flight-still'"},
           {"--config none.yaml", "none.yaml"}}) {
    expect_refused("benchmark dynamic --runs 1 --out results " + arguments, words);
  }
  EXPECT_EQ(roslam("benchmark dynamic --out r --modes magic").code, 2);
  EXPECT_EQ(roslam("benchmark dynamic --out r --modes none none").code, 2);
  EXPECT_EQ(roslam("benchmark dynamic").code, 2);
}

TEST(BarChart, DrawsABarForEachValueAndRefusesGroupsThatDoNotFit) {
  const auto ink = [](const BarChart& chart) {
    const cv::Mat image = draw_bar_chart(chart);
    cv::Mat blue;  // the first series
    cv::inRange(image, cv::Scalar(160, 90, 0), cv::Scalar(200, 130, 40), blue);
    return cv::countNonZero(blue);
  };
  BarChart chart{"title", "metres", {"one", "two"}, {{"a", {0.1, 0.2}}}};
  const int low = ink(chart);
  chart.groups[0].values = {0.2, 0.1};
  const int high = ink(chart);
  EXPECT_GT(high, low) << "a larger value has a taller bar";
  chart.groups[0].values = {NAN, 0.1};
  EXPECT_LT(ink(chart), low) << "an unknown value has none";
  chart.groups[0].values = {NAN, NAN};
  EXPECT_FALSE(draw_bar_chart(chart).empty());
  chart.groups.push_back({"b", {0.1}});
  EXPECT_THROW(draw_bar_chart(chart), InputError);
}

}  // namespace
}  // namespace roslam
