// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "roslam/dense/surface_file.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "tests/program.hpp"
#include "tests/scratch.hpp"
#include "tests/street.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using street::expect_refused;

// A camera flies straight towards a grey wall, 3 m away at first; 1 m before the wall someone walks past and
// something is parked.
class EvaluateMap : public testing::Test {
 protected:
  static constexpr int kFrames = 10;
  static constexpr double kWall = 3.0;  // metres from the first pose
  static constexpr double kThings = 2.0;

  EvaluateMap() : folder_(scratch_path()) {
    fs::remove_all(folder_);
    camera_.width = 160;
    camera_.height = 120;
    camera_.fx = camera_.fy = 100.0;
    camera_.cx = 80.0;
    camera_.cy = 60.0;
    camera_.depth_units_per_metre = 1000.0;
    make_sequence();
    make_run("run", wall());
  }
  ~EvaluateMap() override { fs::remove_all(folder_); }

  static cv::Rect walker(int frame) { return {10 + 2 * frame, 20, 16, 60}; }
  static cv::Rect parked() { return {120, 70, 20, 30}; }
  static std::string stamp(int frame) { return time_text(0.1 * frame); }
  static double travelled(int frame) { return 0.05 * frame; }

  void make_sequence() const {
    for (const char* part : {"rgb", "depth", "labels", "instances", "background/rgb", "background/depth"})
      fs::create_directories(folder_ / "sequence" / part);
    std::ofstream(folder_ / "sequence/camera.yaml") << camera_to_yaml(camera_);
    std::ofstream rgb(folder_ / "sequence/rgb.txt"), depth(folder_ / "sequence/depth.txt");
    Trajectory trajectory;
    for (int i = 0; i < kFrames; ++i) {
      const std::string file = stamp(i) + ".png";
      cv::Mat metres = image(CV_16UC1, 1000.0 * (kWall - travelled(i)));
      put("background/depth/" + file, metres);
      cv::Mat labels = image(CV_8UC1, 2), instances = image(CV_16UC1, 0);
      for (const auto& thing : {walker(i), parked()}) metres(thing) = 1000.0 * (kThings - travelled(i));
      labels(walker(i)) = 11;
      labels(parked()) = 13;
      instances(walker(i)) = 3;
      put("background/rgb/" + file, image(CV_8UC3, 100));
      put("rgb/" + file, image(CV_8UC3, 100));
      put("depth/" + file, metres);
      put("labels/" + file, labels);
      put("instances/" + file, instances);
      rgb << stamp(i) << " rgb/" << file << "\n";
      depth << stamp(i) << " depth/" << file << "\n";
      trajectory.push_back({0.1 * i, pose(i)});
    }
    write_trajectory(folder_ / "sequence/groundtruth.txt", trajectory);
  }

  static cv::Mat image(int type, double value) { return {120, 160, type, cv::Scalar::all(value)}; }
  void put(const std::string& file, const cv::Mat& image) const {
    cv::imwrite((folder_ / "sequence" / file).string(), image);
  }

  static SE3 pose(int frame) {
    return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, 0.0, travelled(frame))};
  }

  // The world of the estimate is not that of the truth.
  static SE3 T_estimate_truth() {
    Vector6d tangent;
    tangent << 3.0, 1.0, -2.0, 0.4, -0.8, 1.2;
    return SE3::exp(tangent);
  }

  SurfacePoint seen_at(double x, double y, double z) const {
    SurfacePoint point;
    point.position = camera_.unproject({x, y}, z).cast<float>();
    point.normal = -Eigen::Vector3f::UnitZ();
    point.colour = cv::Vec3b::all(100);
    return point;
  }

  // What the first frame sees of the wall, up to a column.
  SurfaceMap wall(int columns = 160) const {
    SurfaceMap map;
    for (int y = 0; y < 120; y += 2)
      for (int x = 0; x < columns; x += 2) map.points.push_back(seen_at(x, y, kWall));
    return map;
  }

  void put_thing(const cv::Rect& thing, SurfaceMap& map) const {
    for (int y = thing.y; y < thing.y + thing.height; y += 2)
      for (int x = thing.x; x < thing.x + thing.width; x += 2) map.points.push_back(seen_at(x, y, kThings));
  }

  void make_run(const std::string& name, const SurfaceMap& in_truth) const {
    fs::create_directories(folder_ / name);
    SurfaceMap map = in_truth;
    for (auto& point : map.points)
      point.position = (T_estimate_truth() * point.position.cast<double>()).cast<float>();
    write_surface_ply(folder_ / name / "dense.ply", map, true);
    Trajectory trajectory;
    for (int i = 0; i < kFrames; ++i) trajectory.push_back({0.1 * i, T_estimate_truth() * pose(i)});
    write_trajectory(folder_ / name / "trajectory.txt", trajectory);
  }

  Outcome evaluate(const std::string& arguments) const {
    return shell_in(folder_, "'" ROSLAM_PROGRAM "' evaluate map " + arguments);
  }

  // Expects success and nothing on stderr.
  json figures(const std::string& arguments) const {
    const Outcome outcome = evaluate(arguments + " --every 1 --json");
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    EXPECT_EQ(outcome.error, "");
    return json::parse(outcome.out, nullptr, false).value("estimates", json::array());
  }
  json figures_of_one() const { return figures("--truth sequence --estimate run").at(0); }

  const fs::path folder_;
  Camera camera_;
};

TEST_F(EvaluateMap, FindsNoErrorInAMapOfTheWall) {
  const json found = figures_of_one();
  EXPECT_EQ(found["name"], "run");
  EXPECT_EQ(found["points"], 80 * 60);
  EXPECT_EQ(found["accuracy"], 1.0);
  EXPECT_EQ(found["completeness"], 1.0);
  EXPECT_EQ(found["ghost_points"], 0);
  EXPECT_EQ(found["hole_share"], 0.0);
  EXPECT_EQ(found["colour_error_grey_levels"], 0.0);
  EXPECT_LT(found["trajectory_rmse_m"], 1e-6);
  EXPECT_TRUE(found["missing_of_reference"].is_null());
}

TEST_F(EvaluateMap, ComparesMapsWithEachOtherAndAReference) {
  SurfaceMap ghostly = wall(80);
  put_thing(walker(0), ghostly);
  put_thing(parked(), ghostly);
  make_run("other", ghostly);
  const json found = figures("--truth sequence --estimate run half=other --reference run");
  EXPECT_EQ(found[0]["missing_of_reference"], 0.0);
  EXPECT_EQ(found[1]["name"], "half");
  EXPECT_NEAR(found[1]["completeness"].get<double>(), 0.5, 0.03);
  EXPECT_NEAR(found[1]["missing_of_reference"].get<double>(), 0.5, 0.05);
  EXPECT_EQ(found[1]["hole_share"], found[1]["missing_of_reference"]);
  EXPECT_EQ(found[1]["ghost_points"], 8 * 30);
  EXPECT_EQ(found[1]["resting_points"], 10 * 15);
  EXPECT_DOUBLE_EQ(found[1]["accuracy"].get<double>(), 40.0 * 60.0 / (40.0 * 60.0 + 8.0 * 30.0));
  const Outcome table = evaluate("--truth sequence --estimate run half=other --quiet");
  EXPECT_EQ(table.code, 0) << table.error;
  EXPECT_EQ(table.error, "");
  EXPECT_NE(table.out.find(" half |"), std::string::npos) << table.out;
  EXPECT_NE(table.out.find("| accuracy "), std::string::npos) << table.out;
}

TEST_F(EvaluateMap, TakesTheBackgroundFromElsewhere) {
  fs::rename(folder_ / "sequence/background", folder_ / "room");
  expect_refused(evaluate("--truth sequence --estimate run --quiet"), {"sequence: ", "--background"});
  fs::copy(folder_ / "sequence/rgb.txt", folder_ / "room/rgb.txt");
  fs::copy(folder_ / "sequence/depth.txt", folder_ / "room/depth.txt");
  const std::string arguments = "--truth sequence --background room --estimate run";
  expect_refused(evaluate(arguments + " --quiet"), {"room: ", "--truth-depth-units"});
  SurfaceMap ghostly = wall();
  put_thing(walker(0), ghostly);
  make_run("run", ghostly);
  const json found = figures(arguments + " --truth-depth-units 1000").at(0);
  EXPECT_EQ(found["completeness"], 1.0);
  EXPECT_EQ(found["ghost_points"], 8 * 30);
  // The wall would be ten times as far.
  expect_refused(evaluate(arguments + " --truth-depth-units 100 --quiet"), {"--range"});
}

// As roslam compose writes it: lists that lead to another folder, whose depth has other units.
TEST_F(EvaluateMap, FollowsTheListsOfAComposition) {
  fs::rename(folder_ / "sequence/background", folder_ / "room");
  std::ofstream colour(folder_ / "sequence/background.txt"), depth(folder_ / "sequence/background_depth.txt");
  for (int i = 0; i < kFrames; ++i) {
    const std::string file = stamp(i) + ".png";
    const fs::path metres = folder_ / "room/depth" / file;
    cv::imwrite(metres.string(), 5 * cv::imread(metres.string(), cv::IMREAD_UNCHANGED));
    colour << stamp(i) << " ../room/rgb/" << file << "\n";
    depth << stamp(i) << " ../room/depth/" << file << "\n";
  }
  colour.close();
  depth.close();
  std::ofstream(folder_ / "sequence/composition.json") << R"({"background_depth_units_per_metre": 5000})";
  SurfaceMap ghostly = wall();
  put_thing(walker(0), ghostly);
  make_run("run", ghostly);
  const json found = figures_of_one();
  EXPECT_EQ(found["completeness"], 1.0);
  EXPECT_EQ(found["colour_error_grey_levels"], 0.0);
  EXPECT_EQ(found["ghost_points"], 8 * 30);
  fs::remove(folder_ / "sequence/composition.json");
  expect_refused(evaluate("--truth sequence --estimate run --quiet"), {"sequence: ", "--truth-depth-units"});
}

TEST_F(EvaluateMap, TakesTheDepthOfThingsFromWhereItIsBest) {
  fs::copy(folder_ / "sequence", folder_ / "ideal", fs::copy_options::recursive);
  for (int i = 0; i < kFrames; ++i) put("depth/" + stamp(i) + ".png", image(CV_16UC1, 1000.0));
  SurfaceMap ghostly = wall();
  put_thing(walker(0), ghostly);
  make_run("run", ghostly);
  EXPECT_EQ(figures_of_one()["ghost_points"], 0);  // 1 m too near
  EXPECT_EQ(figures("--truth sequence --background ideal --estimate run").at(0)["ghost_points"], 8 * 30);
}

// Point clouds in one frame, without trajectories or frames.
TEST_F(EvaluateMap, ComparesFilesWithACloud) {
  fs::create_directories(folder_ / "half");
  write_surface_ply(folder_ / "truth.ply", wall(), false);
  write_surface_ply(folder_ / "half/map.ply", wall(80), false);
  const json found = figures("--truth truth.ply --estimate half/map.ply").at(0);
  EXPECT_EQ(found["accuracy"], 1.0);
  EXPECT_NEAR(found["completeness"].get<double>(), 0.5, 0.03);
  EXPECT_EQ(found["ghost_points"], 0);
  EXPECT_TRUE(found["trajectory_rmse_m"].is_null());
  write_surface_ply(folder_ / "truth.ply", {}, false);
  expect_refused(evaluate("--truth truth.ply --estimate half/map.ply --quiet"), {"truth.ply", "no points"});
}

TEST_F(EvaluateMap, TakesAMapForItsRun) {
  EXPECT_EQ(figures("--truth sequence --estimate run/dense.ply").at(0)["accuracy"], 1.0);
}

TEST_F(EvaluateMap, AnEmptyMapIsComparedToo) {
  make_run("run", SurfaceMap());
  const json found = figures_of_one();
  EXPECT_EQ(found["points"], 0);
  EXPECT_EQ(found["completeness"], 0.0);
  EXPECT_TRUE(found["accuracy"].is_null());
  EXPECT_EQ(evaluate("--truth sequence --estimate run --quiet").code, 0);
}

TEST_F(EvaluateMap, TellsWhatIsWrong) {
  const std::string arguments = "--truth sequence --estimate run --quiet";
  expect_refused(evaluate("--truth nowhere --estimate run --camera simulated --quiet"), {"nowhere"});
  expect_refused(evaluate("--truth sequence --estimate nowhere --quiet"),
                 {"nowhere/dense.ply", "--no-dense"});
  expect_refused(evaluate(arguments + " --reference nowhere"), {"nowhere/dense.ply", "--no-dense"});
  fs::rename(folder_ / "sequence/camera.yaml", folder_ / "camera.yaml");
  expect_refused(evaluate(arguments), {"sequence/camera.yaml", "--camera"});
  EXPECT_EQ(evaluate(arguments + " --camera camera.yaml --truth-depth-units 1000").code, 0);
  expect_refused(evaluate(arguments + " --camera simulated --truth-depth-units 1000"),
                 {"sequence: ", "640x480"});
  fs::rename(folder_ / "camera.yaml", folder_ / "sequence/camera.yaml");
  write_trajectory(folder_ / "run/trajectory.txt", {{100.0, SE3()}});
  expect_refused(evaluate(arguments), {"run/trajectory.txt", "clock"});
  fs::remove(folder_ / "run/trajectory.txt");
  expect_refused(evaluate(arguments), {"run/trajectory.txt"});
  fs::remove(folder_ / "run/dense.ply");
  expect_refused(evaluate(arguments), {"run/dense.ply", "--no-dense"});
  EXPECT_EQ(evaluate(arguments + " --tolerance 0.5").code, 2);
  EXPECT_EQ(evaluate(arguments + " --range 0").code, 2);
  EXPECT_EQ(evaluate("--truth sequence").code, 2);
}

// What roslam simulate writes is a truth as it is; here of three frames, and the map is what one of them
// sees.
TEST_F(EvaluateMap, KnowsWhatSimulateWrites) {
  const Outcome simulated =
      shell_in(folder_, "'" ROSLAM_PROGRAM "' simulate street --frames 3 --depth ideal --out street --json");
  ASSERT_EQ(simulated.code, 0) << simulated.error;
  const Trajectory truth = read_trajectory(folder_ / "street/groundtruth.txt").trajectory;
  const Camera camera = read_camera(folder_ / "street/camera.yaml");
  const cv::Mat depth =
      cv::imread((folder_ / "street/background/depth/0.000000.png").string(), cv::IMREAD_UNCHANGED);
  SurfaceMap map;
  for (int y = 0; y < depth.rows; y += 2) {
    for (int x = 0; x < depth.cols; x += 2) {
      const int raw = depth.at<std::uint16_t>(y, x);
      if (raw == 0 || raw > 8000) continue;
      map.points.emplace_back();
      map.points.back().position =
          (truth[0].T_world_camera * camera.unproject({x, y}, raw / 1000.0)).cast<float>();
    }
  }
  fs::create_directories(folder_ / "street_run");
  write_surface_ply(folder_ / "street_run/dense.ply", map, false);
  write_trajectory(folder_ / "street_run/trajectory.txt", truth);
  const json found = figures("--truth street --estimate street_run").at(0);
  EXPECT_GT(found["truth_points"], 1000);
  EXPECT_EQ(found["accuracy"], 1.0);
  EXPECT_GT(found["completeness"], 0.95);
  EXPECT_EQ(found["ghost_points"], 0);
}

}  // namespace
}  // namespace roslam
