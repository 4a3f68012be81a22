// SPDX-License-Identifier: BSD-3-Clause
#include "recording/run_folder.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "tests/scratch.hpp"

namespace roslam {

using namespace recording;

namespace {
namespace fs = std::filesystem;

std::string content(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

// The results of an earlier run stay until there are new ones: a run that fails to start must not cost them.
TEST(RunFolder, KeepsEarlierResultsUntilThereAreNewOnes) {
  const fs::path folder = scratch_path();
  fs::create_directories(folder);
  const std::string earlier = "{\"version\": \"0\", \"source\": \"earlier\"}\n";
  write_file(folder / "run.json", earlier);
  const RunFolder run(folder);
  EXPECT_EQ(content(folder / "run.json"), earlier);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1)
      << "leaves files behind";
}

TEST(RunFolder, ARunThatBeginsMovesEarlierResultsAway) {
  const fs::path folder = scratch_path();
  fs::create_directories(folder / "masks");
  write_file(folder / "run.json", "{\"version\": \"0\", \"source\": \"earlier\"}\n");
  for (const char* name : {"trajectory.txt", "map.roslam", "masks/0.png"})
    write_file(folder / name, "earlier\n");
  write_file(folder / "notes.txt", "mine\n");
  const RunFolder run(folder);
  RunDescription description;
  description.source = "this one";
  run.begin(description, Camera{});
  for (const char* name : {"trajectory.txt", "map.roslam", "masks"}) {
    EXPECT_FALSE(fs::exists(folder / name)) << name << " would pass for a result of a run that is killed";
    EXPECT_TRUE(fs::exists(folder / "previous" / name)) << name;
  }
  EXPECT_TRUE(fs::exists(folder / "notes.txt"));
  EXPECT_FALSE(description.id.empty());
  const auto json = nlohmann::json::parse(content(folder / "run.json"));
  EXPECT_EQ(json["run"], description.id);
  EXPECT_EQ(json["finished"], false);
  EXPECT_EQ(json["source"], "this one");
  EXPECT_NE(content(folder / "previous/run.json").find("earlier"), std::string::npos);
}

TEST(RunFolder, EarlierResultsStayTogether) {
  const fs::path folder = scratch_path();
  const auto run = [&](const std::string& name, bool ends) {
    RunDescription description;
    description.source = name;
    description.version = "0";
    const RunFolder results(folder);
    results.begin(description, Camera{});
    if (ends) write_file(folder / "trajectory.txt", name);
    if (ends && name == "first") write_file(folder / "dense.ply", name);
  };
  run("first", true);
  run("killed", false);
  EXPECT_EQ(content(folder / "previous/trajectory.txt"), "first");
  run("third", true);
  EXPECT_EQ(content(folder / "previous/trajectory.txt"), "first") << "a killed run has no results to keep";
  EXPECT_NE(content(folder / "previous/run.json").find("first"), std::string::npos);
  run("fourth", true);
  EXPECT_EQ(content(folder / "previous/trajectory.txt"), "third");
  EXPECT_FALSE(fs::exists(folder / "previous/dense.ply")) << "of the first run";
}

TEST(RunFolder, RefusesToReplaceTheMapThatItIsToContinue) {
  const fs::path folder = scratch_path();
  fs::create_directories(folder / "previous");
  write_file(folder / "previous/map.roslam", "earlier\n");
  RunDescription description;
  description.map = (folder / "previous/map.roslam").string();
  EXPECT_THROW(RunFolder(folder).begin(description, Camera{}), OutputError);
  EXPECT_TRUE(fs::exists(folder / "previous/map.roslam"));
}

TEST(RunFolder, TheMapThatIsContinuedStays) {
  const fs::path folder = scratch_path();
  fs::create_directories(folder);
  write_file(folder / "run.json", "{\"version\": \"0\", \"source\": \"earlier\"}\n");
  write_file(folder / "map.roslam", "earlier\n");
  RunDescription description;
  description.map = (folder / "map.roslam").string();
  RunFolder(folder).begin(description, Camera{});
  EXPECT_TRUE(fs::exists(folder / "map.roslam"));
}

TEST(RunFolder, RefusesFilesThatNoRunWrote) {
  const fs::path folder = scratch_path();
  fs::create_directories(folder);
  write_file(folder / "trajectory.txt", "mine\n");
  EXPECT_THROW(RunFolder{folder}, OutputError);
  EXPECT_NO_THROW(RunFolder(folder, true));
  EXPECT_EQ(content(folder / "trajectory.txt"), "mine\n");
}

TEST(RunFolder, RefusesADataset) {
  const fs::path folder = scratch_path();
  fs::create_directories(folder);
  write_file(folder / "rgb.txt", "# timestamp filename\n");
  EXPECT_THROW(RunFolder{folder}, OutputError);
}

}  // namespace
}  // namespace roslam
