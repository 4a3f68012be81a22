// SPDX-License-Identifier: BSD-3-Clause
// A sequence restored on the command line and compared with the truth; and what is refused.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/program.hpp"
#include "tests/restoration_scene.hpp"
#include "tests/scratch.hpp"
#include "tests/street.hpp"

namespace roslam::scene {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// A thing without a label walks through a room; the same frames without it are the truth.
class RestoreCommand : public testing::Test {
 protected:
  static constexpr int kFrames = 40;

  static void SetUpTestSuite() {
    folder_ = fs::path(testing::TempDir()) / ("roslam_restore_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    const Stage stage;
    make("walk", stage, true);
    make("truth", stage, false);
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  static std::string stamp(int frame) {
    char text[32];
    std::snprintf(text, sizeof(text), "%.6f", 1.0 + frame / 30.0);
    return text;
  }

  static void make(const std::string& name, const Stage& stage, bool with_thing) {
    for (const char* part : {"rgb", "depth", "instances"}) fs::create_directories(folder_ / name / part);
    std::ofstream rgb(folder_ / name / "rgb.txt"), depth(folder_ / name / "depth.txt");
    std::ofstream(folder_ / name / "camera.yaml") << camera_to_yaml(millimetres(stage.camera()));
    for (int i = 0; i < kFrames; ++i) {
      const Panel thing{-1.2 + 0.04 * i, -0.5, -0.8 + 0.04 * i, 0.6, 1.4};
      const View view = stage.show(with_thing ? room({thing}) : room(), looking_from(0.004 * i, 0.0, 0.0));
      const std::string file = stamp(i) + ".png";
      cv::Mat packed;
      view.depth.convertTo(packed, CV_16U, 1000.0);
      cv::Mat instances;
      view.shows(kThing).convertTo(instances, CV_16U);
      cv::imwrite((folder_ / name / "rgb" / file).string(), in_colour(view.grey));
      cv::imwrite((folder_ / name / "depth" / file).string(), packed);
      cv::imwrite((folder_ / name / "instances" / file).string(), instances);
      rgb << stamp(i) << " rgb/" << file << "\n";
      depth << stamp(i) << " depth/" << file << "\n";
    }
  }

  static Camera millimetres(Camera camera) {
    camera.depth_units_per_metre = 1000.0;
    return camera;
  }

  Outcome roslam(const std::string& arguments) const {
    return shell_in(folder_, "'" ROSLAM_PROGRAM "' " + arguments);
  }

  // Flown once for all cases.
  void fly() const {
    if (fs::exists(folder_ / "run/trajectory.txt")) return;
    const auto outcome = roslam("run walk --camera walk/camera.yaml --dynamic geometry --out run --quiet");
    ASSERT_EQ(outcome.code, 0) << outcome.error;
  }

  json restored(const std::string& method, const std::string& out) const {
    const auto outcome = roslam("restore run --method " + method + " --out " + out + " --json");
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return json::parse(outcome.out, nullptr, false);
  }

  json evaluated(const std::string& arguments) const {
    const auto outcome = roslam("evaluate restoration --no-labels --json " + arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return json::parse(outcome.out, nullptr, false);
  }

  static inline fs::path folder_;
};

TEST_F(RestoreCommand, WritesTheSequenceWithoutWhatMoves) {
  fly();
  const json report = restored("both", "static");
  EXPECT_EQ(report.at("frames"), kFrames);
  EXPECT_GT(report.at("reprojected_share_of_hole").get<double>(), 0.8);
  for (const char* file : {"rgb.txt", "depth.txt", "camera.yaml", "before_after.jpg", "restoration.json"})
    EXPECT_TRUE(fs::is_regular_file(folder_ / "static" / file)) << file;
  const std::string file = stamp(25) + ".png";
  const cv::Mat provenance =
      cv::imread((folder_ / "static/provenance" / file).string(), cv::IMREAD_UNCHANGED);
  const cv::Mat taken = cv::imread((folder_ / "walk/rgb" / file).string());
  const cv::Mat colour = cv::imread((folder_ / "static/rgb" / file).string());
  const cv::Mat truth = cv::imread((folder_ / "truth/rgb" / file).string());
  ASSERT_EQ(provenance.type(), CV_8UC1);
  EXPECT_EQ(difference(colour, taken, provenance == 0), 0.0);
  const cv::Mat thing = cv::imread((folder_ / "walk/instances" / file).string(), cv::IMREAD_UNCHANGED) != 0;
  EXPECT_GT(share_set(thing, provenance != 0), 0.9);
  EXPECT_LT(difference(colour, truth, provenance != 0), 0.3 * difference(taken, truth, provenance != 0));
  // Another system can read it.
  const auto again = roslam("run static --camera static/camera.yaml --dynamic none --out again --quiet");
  EXPECT_EQ(again.code, 0) << again.error;
}

TEST_F(RestoreCommand, IsNearerToTheTruthThanClassicMethods) {
  fly();
  double classic = 0.0;
  for (const std::string method : {"telea", "navier-stokes"}) {
    restored(method, method);
    classic = std::max(classic, evaluated("--truth truth --estimate " + method).at("psnr_db").get<double>());
  }
  restored("both", "compared");
  const json error = evaluated("--truth truth --estimate compared");
  EXPECT_GT(error.at("psnr_db").get<double>(), classic + 3.0);
  EXPECT_LT(error.at("depth_error_reprojected").get<double>(), 0.03);
  // The same by names and with masks of one's own, as for images of other origin.
  const json by_name = evaluated("--truth truth/rgb --estimate compared/rgb --masks compared/provenance");
  EXPECT_EQ(by_name.at("psnr_db"), error.at("psnr_db"));
  EXPECT_TRUE(by_name.at("depth_error_reprojected").is_null());
  EXPECT_GT(evaluated("--truth truth --estimate compared --masks walk/instances")
                .at("pictures_with_hole")
                .get<int>(),
            30);
}

TEST_F(RestoreCommand, ReprojectionAloneLeavesTheRestBlack) {
  fly();
  restored("reprojection", "alone");
  int open = 0;
  for (int frame = 0; frame < kFrames; ++frame) {
    const std::string file = stamp(frame) + ".png";
    const cv::Mat provenance =
        cv::imread((folder_ / "alone/provenance" / file).string(), cv::IMREAD_UNCHANGED);
    const cv::Mat colour = cv::imread((folder_ / "alone/rgb" / file).string());
    open += cv::countNonZero(provenance == 255);
    EXPECT_EQ(cv::norm(colour, cv::NORM_INF, provenance == 255), 0.0) << file;
  }
  EXPECT_GT(open, 0);
}

TEST_F(RestoreCommand, FliesFirstWhereThatWasNotDone) {
  const auto outcome = roslam("restore walk --camera walk/camera.yaml --out flown --every 10 --quiet");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_TRUE(fs::is_regular_file(folder_ / "flown/run/run.json"));
  EXPECT_NE(outcome.out.find("restored 4 frames"), std::string::npos) << outcome.out;
}

TEST_F(RestoreCommand, TheSameRunGivesTheSameBytes) {
  fly();
  restored("both", "first");
  restored("both", "second");
  for (const int frame : {5, 20, 35}) {
    const std::string file = "rgb/" + stamp(frame) + ".png";
    EXPECT_EQ(content(folder_ / "first" / file), content(folder_ / "second" / file)) << file;
  }
}

TEST_F(RestoreCommand, RestoresKeyframesInFlight) {
  const std::string run = "run walk --camera walk/camera.yaml --dynamic geometry --quiet --out ";
  const auto with = roslam(run + "live --restore");
  EXPECT_EQ(with.code, 0) << with.error;
  EXPECT_TRUE(fs::is_regular_file(folder_ / "live/restored/rgb.txt"));
  EXPECT_EQ(with.out.find("restored: 0 "), std::string::npos);
  const json report = json::parse(content(folder_ / "live/restored/restoration.json"));
  EXPECT_GT(report.at("frames").get<int>(), 0);
  EXPECT_EQ(report.at("dropped"), 0);
  std::size_t images = 0;
  for (const auto& file : fs::directory_iterator(folder_ / "live/restored/rgb"))
    images += !cv::imread(file.path().string()).empty();
  EXPECT_EQ(images, report.at("frames"));
  const auto without = roslam(run + "plain");
  EXPECT_EQ(content(folder_ / "live/trajectory.txt"), content(folder_ / "plain/trajectory.txt"));
  EXPECT_TRUE(fs::exists(folder_ / "live/restored"));
  // What an earlier run restored must not pass for the result of a later one.
  const auto later = roslam(run + "live");
  EXPECT_EQ(later.code, 0) << later.error;
  EXPECT_FALSE(fs::exists(folder_ / "live/restored"));
}

TEST_F(RestoreCommand, RestoresKeyframesInRealTime) {
  const auto outcome = roslam(
      "run walk --camera walk/camera.yaml --dynamic geometry --quiet --real-time --restore --out paced");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  const json report = json::parse(content(folder_ / "paced/restored/restoration.json"));
  EXPECT_GT(report.at("frames").get<int>(), 0);
  EXPECT_TRUE(report.at("faults").empty());
}

TEST_F(RestoreCommand, WhatRestoreWroteIsNotDeletedByALaterFlight) {
  const std::string run = "run walk --camera walk/camera.yaml --dynamic geometry --quiet --out home";
  ASSERT_EQ(roslam(run).code, 0);
  ASSERT_EQ(roslam("restore home --out home/restored --every 20 --quiet").code, 0);
  ASSERT_EQ(roslam(run).code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "home/restored/rgb.txt"));
}

TEST_F(RestoreCommand, NeverReplacesTheFramesItRestores) {
  fly();
  using street::expect_refused;
  restored("telea", "source");
  expect_refused(roslam("restore source --camera source/camera.yaml --out source"), {"source", "--out"});
  expect_refused(roslam("restore source/rgb/.. --camera source/camera.yaml --out source"), {"--out"});
  ASSERT_EQ(roslam("run source --camera source/camera.yaml --dynamic none --quiet --out of_source").code, 0);
  expect_refused(roslam("restore of_source --out source"), {"source", "--out"});
  EXPECT_TRUE(fs::exists(folder_ / ("source/rgb/" + stamp(0) + ".png")));
}

TEST_F(RestoreCommand, RestoresASimulatedRun) {
  ASSERT_EQ(roslam("run simulated:turn --traffic light --frames 3 --seed 2 --quiet --out simulated").code, 0);
  const auto outcome = roslam("restore simulated --out turned --quiet");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  ASSERT_EQ(roslam("simulate turn --traffic light --frames 3 --seed 2 --out rendered").code, 0);
  const std::string file = "0.000000.png";
  const cv::Mat provenance =
      cv::imread((folder_ / "turned/provenance" / file).string(), cv::IMREAD_UNCHANGED);
  const cv::Mat colour = cv::imread((folder_ / "turned/rgb" / file).string());
  const cv::Mat taken = cv::imread((folder_ / "rendered/rgb" / file).string());
  ASSERT_FALSE(colour.empty());
  EXPECT_EQ(difference(colour, taken, provenance == 0), 0.0);  // the same flight
  auto old = json::parse(content(folder_ / "simulated/run.json"));
  old.erase("flight");
  std::ofstream(folder_ / "simulated/run.json") << old.dump();
  street::expect_refused(roslam("restore simulated --out turned --quiet"), {"repeat the run"});
}

TEST_F(RestoreCommand, BenchmarkComparesTheMethods) {
  const auto outcome = roslam(
      "benchmark restoration --sequences walk --truth truth --truth-depth-units 1000 --every 8 --methods "
      "telea "
      "reprojection --out results --json --quiet");
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const json report = json::parse(outcome.out);
  const json& methods = report.at("sequences").at(0).at("methods");
  EXPECT_LT(methods.at("reprojection").at("all").at("depth_error_reprojected").get<double>(), 0.05);
  EXPECT_GT(methods.at("telea").at("behind_actors").at("pictures_with_hole").get<int>(), 2);
  EXPECT_TRUE(fs::is_regular_file(folder_ / "results/benchmark.md"));
  EXPECT_TRUE(fs::is_regular_file(folder_ / "results/walk.jpg"));
}

TEST_F(RestoreCommand, DoesWithoutItsNetworkAndSaysSoOnce) {
  fly();
  fs::create_directories(folder_ / "bare");
  fs::copy_file(ROSLAM_PROGRAM, folder_ / "bare/roslam", fs::copy_options::overwrite_existing);
  const auto outcome = shell_in(folder_, "bare/roslam restore run --out without --every 10 --quiet");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  EXPECT_NE(outcome.error.find("classic method"), std::string::npos);
  EXPECT_NE(outcome.out.find("restored 4 frames"), std::string::npos);
  EXPECT_EQ(json::parse(content(folder_ / "without/restoration.json")).at("network"), false);
  street::expect_refused(shell_in(folder_, "bare/roslam restore run --method gan --out without --quiet"),
                         {"roslam-restorer", "--models"});
}

TEST_F(RestoreCommand, RefusesInOneLineWhatItCannotDo) {
  fly();
  using street::expect_refused;
  expect_refused(roslam("restore nowhere --camera simulated --out x"), {"nowhere"});
  expect_refused(roslam("restore walk --out x"), {"--camera"});
  expect_refused(roslam("restore run --out walk"), {"walk", "dataset", "--out"});
  expect_refused(roslam("restore run --out run"), {"run", "--out"});
  expect_refused(roslam("restore run --out truth/rgb/.."), {"truth", "--out"});
  fs::create_directories(folder_ / "album/rgb");
  std::ofstream(folder_ / "album/rgb/holiday.png") << "dear";
  expect_refused(roslam("restore run --out album"), {"album", "--out"});
  EXPECT_TRUE(fs::exists(folder_ / "album/rgb/holiday.png"));
  expect_refused(roslam("restore walk --camera walk/camera.yaml --out truth"), {"truth", "--out"});
  EXPECT_FALSE(fs::exists(folder_ / "truth/run"));  // before anything is flown
  expect_refused(roslam("restore run --out x --models nowhere"), {"roslam-restorer-person.onnx"});
  fs::create_directories(folder_ / "gone");
  for (const char* file : {"run.json", "trajectory.txt", "keyframes.txt", "descriptors.jsonl"})
    fs::copy_file(folder_ / "run" / file, folder_ / "gone" / file, fs::copy_options::overwrite_existing);
  const auto without_masks = roslam("restore gone --out x --quiet");
  EXPECT_EQ(without_masks.code, 0) << without_masks.error;
  EXPECT_NE(without_masks.out.find("mask missing or unusable"), std::string::npos) << without_masks.out;
  std::ofstream(folder_ / "gone/run.json") << "{";
  expect_refused(roslam("restore gone --out x"), {"run.json"});
  fs::copy_file(folder_ / "run/run.json", folder_ / "gone/run.json", fs::copy_options::overwrite_existing);
  auto moved = json::parse(content(folder_ / "gone/run.json"));
  moved["source"] = "elsewhere";
  std::ofstream(folder_ / "gone/run.json") << moved.dump();
  expect_refused(roslam("restore gone --out x"), {"elsewhere", "not there"});
  EXPECT_EQ(roslam("restore run").code, 2);
  EXPECT_EQ(roslam("restore run --out x --camera simulated").code, 2);
  EXPECT_EQ(roslam("run walk --camera walk/camera.yaml --out x --models y --no-dense").code, 2);
  EXPECT_EQ(roslam("run walk --camera walk/camera.yaml --out x --models y --dynamic none").code, 2);
  EXPECT_EQ(roslam("run walk --camera walk/camera.yaml --out x --restore --dynamic none").code, 2);
  EXPECT_EQ(roslam("restore run --out x --method magic").code, 2);
}

TEST_F(RestoreCommand, EvaluationRefusesWhatTellsNothing) {
  fly();
  using street::expect_refused;
  restored("telea", "scored");
  const std::string evaluate = "evaluate restoration --no-labels --quiet ";
  expect_refused(roslam(evaluate + "--truth nowhere --estimate scored"), {"nowhere"});
  expect_refused(roslam(evaluate + "--truth truth --estimate scored --masks nowhere"), {"nowhere"});
  fs::create_directories(folder_ / "other");
  cv::imwrite((folder_ / "other/x.png").string(), cv::Mat(240, 320, CV_8UC3, cv::Scalar::all(1)));
  expect_refused(roslam(evaluate + "--truth other --estimate scored"), {"no image of the time or name"});
  expect_refused(roslam(evaluate + "--truth truth --estimate scored --masks truth/instances"),
                 {"no mask has a hole"});
}

}  // namespace
}  // namespace roslam::scene
