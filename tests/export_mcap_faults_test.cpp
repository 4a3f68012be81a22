// SPDX-License-Identifier: BSD-3-Clause
// roslam export of runs that are not complete, and what is refused and leaves nothing behind.
#include "tests/exported_run.hpp"

namespace roslam {
namespace {

class ExportMcapFaults : public ExportedRun {
 protected:
  static bool is_there(const std::string& name) { return fs::exists(folder_ / name); }

  // One line that has the words; no file, and none half written.
  static void expect_nothing(const Outcome& outcome, const std::string& words, int code = 1) {
    EXPECT_EQ(outcome.code, code) << outcome.error;
    EXPECT_NE(outcome.error.find(words), std::string::npos) << outcome.error;
    EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
    EXPECT_FALSE(is_there("x.mcap"));
    EXPECT_FALSE(is_there("x.mcap.part"));
  }

  static void cut(const std::string& name, std::size_t bytes) {
    const fs::path file = folder_ / "copy" / name;
    fs::resize_file(file, fs::file_size(file) - bytes);
  }
};

TEST_F(ExportMcapFaults, ASourceThatIsGoneCostsTheImagesOnly) {
  change_report([](auto& json) { json["source"] = "gone"; });
  const Outcome outcome = exported();
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.error.find("note: images are missing: the run is of gone, which is not there"),
            std::string::npos)
      << outcome.error;
  const Topics topics = this->topics();
  EXPECT_EQ(topics.count("/camera/image/compressed"), 0U);
  EXPECT_EQ(topics.at("/camera_pose").size(),
            read_trajectory(folder_ / "copy/trajectory.txt").trajectory.size());
  EXPECT_EQ(topics.at("/map/dense").size(), 1U);
  // One that has other images now.
  change_report([](auto& json) {
    json["source"] = "data";
    json["camera"]["width"] = 320;
  });
  const Outcome other = exported();
  ASSERT_EQ(other.code, 0) << other.error;
  EXPECT_NE(other.error.find("note: 12 x image of the source skipped: "), std::string::npos) << other.error;
  EXPECT_EQ(this->topics().count("/camera/image/compressed"), 0U);
}

TEST_F(ExportMcapFaults, WhatTheRunDoesNotHaveIsLeftOut) {
  for (const char* name :
       {"odometry.csv", "dense.ply", "keyframes.txt", "map.ply", "map.roslam", "masks", "descriptors.jsonl"})
    fs::remove_all(folder_ / "copy" / name);
  const Topics topics = topics_with("--every 6");
  for (const char* name : {"/odometry", "/map/dense", "/map/landmarks", "/camera/removed/compressed"})
    EXPECT_EQ(topics.count(name), 0U) << name;
  EXPECT_EQ(topics.at("/camera/image/compressed").size(), 2U);
  const SE3 T_body_camera =
      transforms_of(topics.at("/tf_static").front()).at("base_link camera_optical_frame");
  const Trajectory trajectory = read_trajectory(folder_ / "copy/trajectory.txt").trajectory;
  ASSERT_EQ(topics.at("/tf").size(), trajectory.size());
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const auto tree = transforms_of(topics.at("/tf")[i]);
    EXPECT_LT(difference(tree.at("map odom"), SE3()), 1e-15);
    EXPECT_LT(difference(tree.at("odom base_link") * T_body_camera, trajectory[i].T_world_camera), 1e-9);
  }
}

TEST_F(ExportMcapFaults, ARunThatWasKilledIsExportedToItsLastPose) {
  change_report([](auto& json) {
    json.erase("options");
    json.erase("frames");
    json["finished"] = false;
  });
  for (const char* name : {"map.ply", "dense.ply", "keyframes.txt", "report.html"})
    fs::remove_all(folder_ / "copy" / name);
  cut("odometry.csv", 100);
  const std::string path = content(folder_ / "copy/trajectory.txt");
  std::size_t end = 0;  // of six poses and half of the next
  for (int line = 0; line < 7; ++line) end = path.find('\n', end) + 1;
  rewrite("trajectory.txt", path.substr(0, end + 30));
  const std::string odometry = content(folder_ / "copy/odometry.csv");
  end = 0;
  for (int line = 0; line < 9; ++line) end = odometry.find('\n', end) + 1;
  rewrite("odometry.csv", odometry.substr(0, end + 200));
  cut("descriptors.jsonl", 40);
  const Topics topics = topics_with();
  EXPECT_EQ(topics.at("/camera_pose").size(), 6U);
  ASSERT_EQ(topics.at("/odometry").size(), 8U);
  EXPECT_EQ(topics.at("/camera/image/compressed").back().time, topics.at("/odometry").back().time);
  EXPECT_GT(topics.count("/map/landmarks"), 0U);             // of the last checkpoint
  const auto last = transforms_of(topics.at("/tf").back());  // where it is in the map is not known
  EXPECT_EQ(last.size(), 1U);
  EXPECT_EQ(last.count("odom base_link"), 1U);
}

TEST_F(ExportMcapFaults, ARunWithoutPosesHasItsMaps) {
  rewrite("trajectory.txt", "# timestamp tx ty tz qx qy qz qw\n");
  rewrite("odometry.csv", "");
  const Topics topics = topics_with();
  EXPECT_EQ(topics.count("/tf") + topics.count("/path"), 0U);
  EXPECT_EQ(topics.count("/map/dense"), 1U);
  EXPECT_EQ(topics.at("/camera/image/compressed").size(), kFrames);
  for (const char* name : {"map.ply", "map.roslam", "dense.ply"}) fs::remove(folder_ / "copy" / name);
  fs::remove(folder_ / "x.mcap");
  expect_nothing(exported(), "copy: the run has neither a pose nor a map");
}

TEST_F(ExportMcapFaults, WhatCannotBeExportedIsRefused) {
  expect_nothing(roslam("export data --mcap x.mcap"), "data/run.json: no such file; give the folder");
  expect_nothing(roslam("export nowhere --mcap x.mcap"), "nowhere/run.json: no such file");
  expect_nothing(roslam("export copy"), "--mcap", 2);
  expect_nothing(exported("--every 0"), "--every", 2);
  expect_nothing(exported("--jpeg-quality 101"), "--jpeg-quality", 2);
  expect_nothing(roslam("export copy --mcap copy"), "copy: is a folder");
  expect_nothing(roslam("export copy --mcap none/x.mcap"), "none/x.mcap: its folder does not exist");
  expect_nothing(roslam("export copy --mcap copy/map.ply"), "is a file of another kind", 2);
  cut("dense.ply", 1000);
  expect_nothing(exported(), "copy/dense.ply");
  fs::copy(folder_ / "run/dense.ply", folder_ / "copy/dense.ply", fs::copy_options::overwrite_existing);
  rewrite("odometry.csv", "1.0,tracking,nonsense\n2.0,tracking,nonsense\n");
  expect_nothing(exported(), "copy/odometry.csv, line 1");
  fs::remove(folder_ / "copy/odometry.csv");
  rewrite("trajectory.txt", "-5.0 0 0 0 0 0 0 1\n");
  expect_nothing(exported(), "a time that ROS cannot stamp");
  rewrite("run.json", "{\"finished\": tr");
  expect_nothing(exported(), "copy/run.json");
}

TEST_F(ExportMcapFaults, AFullDiskLeavesNothingAndTheOlderFile) {
  const std::string limited = "ulimit -f 500; '" ROSLAM_PROGRAM "' export copy --quiet --mcap x.mcap";
  expect_nothing(shell_in(folder_, limited), "x.mcap");
  ASSERT_EQ(exported("--no-images --max-points 10").code, 0);
  const std::string older = content(folder_ / "x.mcap");
  const Outcome outcome = shell_in(folder_, limited);
  EXPECT_EQ(outcome.code, 1) << outcome.error;
  EXPECT_EQ(content(folder_ / "x.mcap"), older);
  EXPECT_FALSE(is_there("x.mcap.part"));
  ASSERT_EQ(exported().code, 0);  // replaces a file of its kind
  EXPECT_GT(fs::file_size(folder_ / "x.mcap"), older.size());
  EXPECT_EQ(roslam("export copy --quiet --mcap /dev/full").code, 1);
}

TEST_F(ExportMcapFaults, AnInterruptLeavesNothing) {
  change_report([](auto& json) {  // whose images take minutes
    json["source"] = "simulated:street";
    json["flight"] = {{"frames", "5000"}, {"traffic", "none"}};
  });
  const Outcome outcome = shell_in(
      folder_, "{ '" ROSLAM_PROGRAM
               "' export copy --quiet --mcap x.mcap & P=$!; "
               "while kill -0 $P && [ ! -s x.mcap.part ]; do sleep 0.05; done; kill -TERM $P; wait $P; }");
  expect_nothing(outcome, "x.mcap: interrupted before it was complete; nothing was written");
}

TEST_F(ExportMcapFaults, ADamagedMaskCostsItsTintOnly) {
  for (const auto& mask : fs::directory_iterator(folder_ / "copy/masks")) fs::resize_file(mask.path(), 20);
  const Outcome outcome = exported();
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.error.find(" x mask cannot be read"), std::string::npos) << outcome.error;
  EXPECT_EQ(topics().at("/camera/removed/compressed").size(), kFrames);
}

}  // namespace
}  // namespace roslam
