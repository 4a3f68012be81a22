// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/benchmark_fixture.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class BenchmarkMap : public BenchmarkTest {};

TEST_F(BenchmarkMap, ComparesTheMapsOfEveryStep) {
  const auto result = roslam("benchmark map --traffic light --frames 16 --out results --json --quiet");
  ASSERT_EQ(result.code, 0) << result.error;
  const json report = json::parse(result.out);
  EXPECT_EQ(report, json::parse(content(folder_ / "results/benchmark.json")));
  ASSERT_EQ(report["sequences"].size(), 1U);
  const json& sequence = report["sequences"][0];
  ASSERT_EQ(sequence["maps"].size(), 5U);
  std::map<std::string, json> maps;
  for (const json& map : sequence["maps"]) maps[map["name"]] = map;
  // Cars that drive and park hide a part of the street, which removal leaves open and restoration fills.
  EXPECT_GT(
      maps["no rejection"]["resting_points"].get<int>() + maps["no rejection"]["ghost_points"].get<int>(),
      10 * (maps["rejection only"]["resting_points"].get<int>() +
            maps["rejection only"]["ghost_points"].get<int>()));
  EXPECT_LT(maps["all stages"]["missing_of_reference"], maps["rejection only"]["missing_of_reference"]);
  EXPECT_GT(maps["empty scene"]["completeness"], maps["rejection only"]["completeness"]);
  const double open = maps["rejection only"]["missing_of_reference"],
               left = maps["all stages"]["missing_of_reference"];
  EXPECT_NEAR(sequence["filled_share"].get<double>(), 1.0 - left / open, 1e-9);
  // All have the same trajectory.
  for (const char* name : {"rejection only", "with reprojection", "all stages"})
    EXPECT_EQ(maps[name]["trajectory_rmse_m"], maps["no rejection"]["trajectory_rmse_m"]);
  EXPECT_GT(sequence["fuse_milliseconds"], 0.0);
  EXPECT_GT(fs::file_size(folder_ / "results/simulated-street.jpg"), 10000U);
  const std::string markdown = content(folder_ / "results/benchmark.md");
  for (const char* words : {"# Dense maps", "| completeness ", "% is filled", "simulated-street.jpg"})
    EXPECT_NE(markdown.find(words), std::string::npos) << words;
}

TEST_F(BenchmarkMap, TellsWhatItNeeds) {
  ASSERT_EQ(roslam("simulate street --frames 2 --out flight --json").code, 0);
  const auto result = roslam("benchmark map --sequences flight --out results --quiet");
  EXPECT_EQ(result.code, 1);
  EXPECT_NE(result.error.find("--truth"), std::string::npos) << result.error;
  EXPECT_EQ(roslam("benchmark map --sequences flight flight --truth flight --out results").code, 2);
  expect_refused("benchmark map --sequences nowhere --out results", "nowhere");
}

}  // namespace
}  // namespace roslam
