// SPDX-License-Identifier: BSD-3-Clause
// Maps on the command line: saved, continued, inspected, merged, exported; and bad input.
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <set>

#include "tests/street.hpp"

namespace roslam::street {
namespace {

class MapCommand : public Dataset {
 protected:
  // Tracks frames of the street, from begin to end of the recorded flight; mirrored, they are another place.
  fs::path fly(const std::string& name, std::size_t begin, std::size_t end, const std::string& arguments = "",
               bool mirrored = false) {
    make(end);
    colour_.erase(colour_.begin(), colour_.begin() + static_cast<std::ptrdiff_t>(begin));
    depth_.erase(depth_.begin(), depth_.begin() + static_cast<std::ptrdiff_t>(begin));
    write_lists();
    if (mirrored) {
      for (std::size_t i = 0; i < colour_.size(); ++i) {
        for (const fs::path& file : {colour(i), depth(i)}) {
          cv::Mat image = cv::imread(file.string(), cv::IMREAD_UNCHANGED);
          cv::flip(image, image, 1);
          put_image(file, image);
        }
      }
    }
    const fs::path out = kept_ / name;
    const Outcome outcome =
        run_program("run '" + data_.string() + "' --quiet --camera simulated --dynamic none --out '" +
                        out.string() + "' " + arguments,
                    kept_);
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    EXPECT_EQ(outcome.error, "");
    return out;
  }

  Outcome map(const std::string& arguments) const { return run_program("map " + arguments, kept_); }

  nlohmann::json info(const fs::path& file) const {
    const Outcome outcome = map("info --json '" + file.string() + "'");
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }

  static nlohmann::json report_of(const fs::path& out) {
    return nlohmann::json::parse(content(out / "run.json"));
  }

  void SetUp() override { fs::create_directories(kept_); }
  void TearDown() override {
    Dataset::TearDown();
    fs::remove_all(kept_);
  }

  const fs::path kept_ = scratch_path("_kept");
};

TEST_F(MapCommand, AnotherFlightFindsItselfInTheMapAndLeavesItAlone) {
  const fs::path first = fly("first", 0, 40);
  const std::string bytes = content(first / "map.roslam");
  const auto found = info(first / "map.roslam");
  EXPECT_EQ(found["keyframes"], report_of(first)["keyframes"]);
  EXPECT_EQ(found["landmarks"], report_of(first)["landmarks"]);
  EXPECT_EQ(found["sessions"], 1);
  EXPECT_EQ(found["submaps"], 1);

  const std::string map_option = "--map '" + (first / "map.roslam").string() + "' ";
  const fs::path second = fly("second", 10, 40, map_option + "--localise-only");
  EXPECT_EQ(content(first / "map.roslam"), bytes);
  EXPECT_FALSE(fs::exists(second / "map.roslam"));
  EXPECT_EQ(report_of(second)["frames"]["tracked"], 30);
  EXPECT_TRUE(report_of(second)["map"]["localise_only"]);
  // In the frame of the map: the poses of the first session at the same times.
  const auto was = read_trajectory(first / "trajectory.txt").trajectory;
  const auto is = read_trajectory(second / "trajectory.txt").trajectory;
  ASSERT_EQ(is.size(), 30U);
  for (std::size_t i = 0; i < is.size(); ++i) {
    ASSERT_EQ(is[i].timestamp, was[i + 10].timestamp);
    EXPECT_LT((is[i].T_world_camera.inverse() * was[i + 10].T_world_camera).translation().norm(), 0.03) << i;
  }

  // The output folder may be that of the map.
  const fs::path same = fly("first", 10, 40, map_option + "--localise-only");
  EXPECT_EQ(content(same / "map.roslam"), bytes);

  const fs::path further = fly("further", 20, 60, map_option);
  EXPECT_EQ(content(first / "map.roslam"), bytes);
  const auto grown = info(further / "map.roslam");
  EXPECT_EQ(grown["submaps"], 1);
  EXPECT_GT(grown["keyframes"], found["keyframes"]);
  EXPECT_EQ(grown["sessions"], 2);
}

TEST_F(MapCommand, MapsThatOverlapAreMergedAndExported) {
  const fs::path first = fly("first", 0, 40) / "map.roslam";
  const fs::path second = fly("second", 20, 60) / "map.roslam";
  const fs::path both = kept_ / "both.roslam";
  const Outcome merged =
      map("merge '" + first.string() + "' '" + second.string() + "' --quiet --out '" + both.string() + "'");
  ASSERT_EQ(merged.code, 0) << merged.error;
  const auto found = info(both);
  EXPECT_EQ(found["submaps"], 1);
  EXPECT_EQ(found["sessions"], 2);
  // A frame that both flights took as a keyframe is one keyframe of the merged map.
  std::set<double> times;
  for (const char* flight : {"first", "second"}) {
    for (const StampedPose& pose : read_trajectory(kept_ / flight / "keyframes.txt").trajectory)
      times.insert(pose.timestamp);
  }
  EXPECT_EQ(found["keyframes"].get<std::size_t>(), times.size());
  EXPECT_GT(times.size(), info(first)["keyframes"].get<std::size_t>());

  const Outcome exported =
      map("export '" + first.string() + "' --ply '" + (kept_ / "m.ply").string() + "' --keyframes '" +
          (kept_ / "k.txt").string() + "' --camera '" + (kept_ / "c.yaml").string() + "'");
  ASSERT_EQ(exported.code, 0) << exported.error;
  EXPECT_EQ(content(kept_ / "m.ply"), content(kept_ / "first/map.ply"));
  EXPECT_EQ(content(kept_ / "k.txt"), content(kept_ / "first/keyframes.txt"));
  Camera exported_camera = read_camera(kept_ / "c.yaml");
  exported_camera.T_body_camera = camera_preset("simulated")->T_body_camera;  // a map does not hold it
  EXPECT_EQ(exported_camera, *camera_preset("simulated"));
}

TEST_F(MapCommand, ARunFolderStandsForItsMap) {
  const fs::path first = fly("first", 0, 30);
  EXPECT_EQ(info(first), info(first / "map.roslam"));
  const auto quoted = [](const fs::path& path) { return std::string(1, '\'') + path.string() + "' "; };
  const std::string out = quoted(kept_ / "out");
  ASSERT_EQ(map("export " + quoted(first) + "--keyframes " + out).code, 0);
  EXPECT_EQ(content(kept_ / "out"), content(first / "keyframes.txt"));
  const fs::path localised = fly("localised", 10, 30, "--localise-only --map " + quoted(first));
  fly("further", 20, 50, "--map " + quoted(first));
  for (const std::string& arguments :
       {"info " + quoted(localised), "export --keyframes " + out + quoted(localised),
        "merge --quiet --out " + quoted(kept_ / "merged") + quoted(first) + quoted(localised)})
    expect_refused(map(arguments),
                   {localised.string() + ": the folder holds no map.roslam", "--localise-only"});
  expect_refused(run("--dynamic none --map " + quoted(localised)), {"holds no map.roslam"});
}

TEST_F(MapCommand, AMapIsNotMergedWithItselfOrItsContinuation) {
  const fs::path first = fly("first", 0, 40) / "map.roslam";
  const fs::path copy = kept_ / "copy.roslam";
  fs::copy_file(first, copy);
  const auto merge = [&](const fs::path& a, const fs::path& b) {
    return map("merge '" + a.string() + "' '" + b.string() + "' --quiet --out '" + (kept_ / "both").string() +
               "'");
  };
  for (const auto& other : {first, copy})
    expect_refused(merge(first, other), {other.string(), "contains all of its keyframes"});
  EXPECT_FALSE(fs::exists(kept_ / "both"));
  const fs::path further = fly("further", 30, 60, "--map '" + first.string() + "'") / "map.roslam";
  const Outcome merged = merge(further, first);
  if (merged.code != 0) {
    expect_refused(merged, {"contains all of its keyframes"});
  } else {  // keyframes of the first that the continuation culled
    EXPECT_LE(info(kept_ / "both")["keyframes"].get<int>(),
              info(further)["keyframes"].get<int>() + info(first)["keyframes"].get<int>() / 2);
  }
}

TEST_F(MapCommand, WhatDoesNotFitTogetherIsRefused) {
  const fs::path street = fly("street", 0, 30) / "map.roslam";
  const fs::path mirrored = fly("mirrored", 0, 30, "", true) / "map.roslam";
  const fs::path both = kept_ / "both.roslam";
  expect_refused(map("merge '" + street.string() + "' '" + mirrored.string() + "' --quiet --out '" +
                     both.string() + "'"),
                 {street.string(), mirrored.string(), "no place of one is recognised in the other"});
  EXPECT_FALSE(fs::exists(both));
  std::ofstream(kept_ / "patient.yaml") << "tracker: {new_submap_after_lost: 100}\n";
  const std::string elsewhere = "run '" + data_.string() +
                                "' --quiet --camera simulated --dynamic none --config '" +
                                (kept_ / "patient.yaml").string() + "' --out '" + (kept_ / "lost").string() +
                                "' --map '" + street.string() + "'";
  const std::string said = "no frame was recognised in the map";
  expect_refused(run_program(elsewhere, kept_), {data_.string(), said, "leave out --map"});
  expect_refused(run_program(elsewhere + " --localise-only", kept_), {said, "leave out --localise-only"});
  EXPECT_FALSE(report_of(kept_ / "lost")["map"]["recognised"]);
  expect_refused(map("export '" + street.string() + "' --keyframes k.txt --flight 7"),
                 {street.string(), "session 7"});
  EXPECT_EQ(map("export '" + street.string() + "'").code, 2);
  EXPECT_EQ(map("merge '" + street.string() + "' --out x").code, 2);

  const std::string good = content(street);
  const auto run_with = [&](const fs::path& file, const std::string& camera = "simulated") {
    return run("--map '" + file.string() + "' --dynamic none", camera);
  };
  const fs::path bad = kept_ / "bad.roslam";
  expect_refused(run_with(bad), {bad.string(), "no such file"});
  put(bad, "");
  expect_refused(run_with(bad), {bad.string(), "empty"});
  put(bad, good.substr(0, good.size() / 2));
  expect_refused(run_with(bad), {bad.string(), "not as long as it should be"});
  std::string altered = good;
  altered[altered.size() / 2] ^= 1;
  put(bad, altered);
  expect_refused(run_with(bad), {bad.string(), "checksum"});
  expect_refused(map("info '" + bad.string() + "'"), {bad.string(), "checksum"});
  Camera other = *camera_preset("simulated");
  other.fx += 5.0;
  put(kept_ / "other.yaml", camera_to_yaml(other));
  expect_refused(run_with(street, (kept_ / "other.yaml").string()), {street.string(), "another camera"});
  EXPECT_EQ(run("--localise-only").code, 2);
}

TEST_F(MapCommand, AFullDiskCostsNoMap) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  make(10);
  ASSERT_EQ(run("--dynamic none").code, 0);
  const std::string bytes = content(run_ / "map.roslam");
  make(12);
  fs::create_directories(run_);
  put(run_ / "map.roslam", bytes);
  fs::create_symlink("/dev/full", run_ / "map.roslam.part");
  expect_refused(run("--dynamic none --overwrite"),
                 {(run_ / "map.roslam").string(), "cannot be written in full"});
  EXPECT_EQ(content(run_ / "previous/map.roslam"), bytes);
  EXPECT_FALSE(fs::exists(fs::symlink_status(run_ / "map.roslam.part")));
  EXPECT_GT(fs::file_size(run_ / "trajectory.txt"), 100U);
}

}  // namespace
}  // namespace roslam::street
