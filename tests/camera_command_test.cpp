// SPDX-License-Identifier: BSD-3-Clause
// roslam camera on the command line, and a flight with a fisheye camera.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "recording/recorded_run.hpp"
#include "tests/camera_files.hpp"
#include "tests/street.hpp"

namespace roslam::street {
namespace {

class CameraCommand : public Dataset {
 protected:
  std::string file(const std::string& text, const std::string& name = "given.yaml") const {
    put(scratch_ / name, text);
    const std::string path = (scratch_ / name).string();
    return "'" + path + "'";
  }

  Outcome camera(const std::string& arguments) const { return run_program("camera " + arguments, scratch_); }

  nlohmann::json shown(const std::string& arguments) const {
    const Outcome outcome = camera("show --json " + arguments);
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    return nlohmann::json::parse(outcome.out, nullptr, false);
  }
};

TEST_F(CameraCommand, ShowsWhatIsUnderstood) {
  const auto preset = shown("simulated");
  EXPECT_EQ(preset["format"], "a preset");
  EXPECT_NEAR(preset["field_of_view_degrees"]["horizontal"].get<double>(), 2.0 * 39.69, 0.05);
  EXPECT_NEAR(preset["mount_degrees"][1].get<double>(), 14.9, 0.01) << "pitched down";
  EXPECT_EQ(preset["corner_distortion_pixels"], nlohmann::json({0, 0, 0, 0}));
  const auto fisheye = shown(file(kKalibr) + "#cam1");
  EXPECT_EQ(fisheye["model"], "fisheye");
  EXPECT_EQ(fisheye["distortion"], nlohmann::json({0.0034, 0.0007, -0.002, 0.0002}));
  EXPECT_TRUE(fisheye["depth_units_per_metre"].is_null());
  EXPECT_TRUE(fisheye["corner_distortion_pixels"][0].is_null()) << "the lens does not cover it";
  EXPECT_EQ(shown(file(kKalibr) + " --depth-units 1000")["depth_units_per_metre"], 1000);
  const Outcome words = camera("show " + file(kKalibr) + "#cam1");
  for (const char* part : {"a Kalibr camera chain", "512 x 512", "fisheye", "units not set", "80 degrees"})
    EXPECT_NE(words.out.find(part), std::string::npos) << part << ": " << words.out;
  for (const auto& name : camera_preset_names()) EXPECT_EQ(camera("show " + name).code, 0) << name;
}

TEST_F(CameraCommand, SaysThatThePresetOfTheD455HasNoDistortion) {
  const Outcome outcome = camera("show d455");
  for (const char* part : {"no lens distortion", "D455", "camera_info"})
    EXPECT_NE(outcome.out.find(part), std::string::npos) << part << ": " << outcome.out;
  EXPECT_EQ(camera("show tum-fr1").out.find("no lens distortion"), std::string::npos);
}

TEST_F(CameraCommand, ConvertsBetweenAllFormats) {
  file(kKalibr);
  const Camera camera_of_kalibr = load_camera((scratch_ / "given.yaml").string());
  for (const std::string format : {"ros", "kalibr", "opencv", "roslam"}) {
    const fs::path out = scratch_ / (format + ".yaml");
    const Outcome outcome =
        camera("convert " + file(kKalibr) + " --to " + format + " --out '" + out.string() + "'");
    ASSERT_EQ(outcome.code, 0) << outcome.error;
    EXPECT_EQ(outcome.out, "");
    const Camera read = load_camera(out.string());
    EXPECT_EQ(read.distortion, camera_of_kalibr.distortion) << format;
    EXPECT_EQ(read.fx, camera_of_kalibr.fx) << format;
    EXPECT_EQ(read.width, camera_of_kalibr.width) << format;
    EXPECT_EQ(camera("convert " + file(kKalibr) + " --to " + format).out, content(out)) << "to stdout";
    EXPECT_EQ(camera("convert d455 --to " + format + " --out '" + out.string() + "'").code, 0) << "replaces";
  }
  const Outcome own = camera("convert " + file(kStereo) + " --size 640x480 --depth-units 1000");
  ASSERT_EQ(own.code, 0) << own.error;
  put(scratch_ / "own.yaml", own.out);
  EXPECT_EQ(load_camera((scratch_ / "own.yaml").string()).depth_units_per_metre, 1000.0);
}

TEST_F(CameraCommand, RefusesWhatItCannotDo) {
  expect_refused(camera("show " + file(kStereo)), {"given.yaml", "OpenCV", "--size"});
  expect_refused(camera("show " + file(kStereo) + " --size 640"), {"--size 640", "640x480"});
  expect_refused(camera("show kinect"), {"kinect", "tum-fr1", "bonn"});
  expect_refused(camera("show '" + scratch_.string() + "'"), {scratch_.string()});
  expect_refused(camera("convert tum-fr1 --to kalibr"), {"tum-fr1", "k1 k2 p1 p2"});
  EXPECT_EQ(camera("convert d455 --to matlab").code, 2);
  EXPECT_EQ(camera("convert d455 --depth-units 0").code, 2);
  EXPECT_EQ(camera("show").code, 2);
  put(scratch_ / "notes.txt", "my notes\n");
  EXPECT_EQ(camera("convert d455 --out '" + (scratch_ / "notes.txt").string() + "'").code, 2);
  EXPECT_EQ(content(scratch_ / "notes.txt"), "my notes\n");
}

// The street as an equidistant fisheye sees it.
TEST_F(CameraCommand, ChecksARecording) {
  const std::string street = "check '" + kFolder.string() + "' --camera simulated --quiet --json";
  const Outcome clean = camera(street);
  EXPECT_EQ(clean.code, 0) << clean.error << clean.out;
  EXPECT_EQ(clean.error, "");
  const auto report = nlohmann::json::parse(clean.out, nullptr, false);
  EXPECT_EQ(report["nothing_misfits"], true);
  for (const char* name : {"depth_scale", "registration", "timing", "distortion"})
    EXPECT_NE(report[name]["verdict"], "does not fit") << name;
  const Outcome wrong = camera(street + " --fault depth-too-large");
  EXPECT_EQ(wrong.code, 3);
  EXPECT_NE(wrong.error.find("depth scale"), std::string::npos) << wrong.error;
  EXPECT_EQ(std::count(wrong.error.begin(), wrong.error.end(), '\n'), 1) << wrong.error;
  const auto found = nlohmann::json::parse(wrong.out, nullptr, false);
  EXPECT_EQ(found["depth_scale"]["verdict"], "does not fit");
  EXPECT_EQ(found["depth_scale"]["remedy"], "set depth_units_per_metre 1000");
  const Outcome preset = camera("check '" + kFolder.string() + "' --camera d455 --quiet");
  EXPECT_NE(preset.out.find("no lens distortion"), std::string::npos) << preset.out << preset.error;
}

TEST_F(CameraCommand, RefusesToCheckWhatHasNoDepth) {
  make(5);
  expect_refused(camera("check '" + data_.string() + "' --camera simulated --quiet"),
                 {"10 consecutive frames"});
  expect_refused(camera("check '" + data_.string() + "' --quiet"), {"--camera"});
  expect_refused(camera("check /nowhere --camera simulated"), {"/nowhere"});
  EXPECT_EQ(camera("check").code, 2);
  EXPECT_EQ(camera("check '" + data_.string() + "' --camera simulated --fault none").code, 2);
}

class FisheyeFlight : public CameraCommand {
 protected:
  static constexpr std::size_t kFlight = 30;
  static constexpr double kFocal = 330.0;
  static constexpr int kWidth = 512, kHeight = 384;

  void SetUp() override {
    make(kFlight);
    const Camera pinhole = *camera_preset("simulated");
    cv::Mat x(kHeight, kWidth, CV_32FC1), y(kHeight, kWidth, CV_32FC1);
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const Eigen::Vector2d raw((u - 255.5) / kFocal, (v - 191.5) / kFocal);
        const double angle = std::max(raw.norm(), 1e-9);  // from the axis; k1 to k4 are 0
        const Eigen::Vector2d seen = std::tan(angle) / angle * raw;
        x.at<float>(v, u) = static_cast<float>(pinhole.fx * seen.x() + pinhole.cx);
        y.at<float>(v, u) = static_cast<float>(pinhole.fy * seen.y() + pinhole.cy);
      }
    }
    for (std::size_t i = 0; i < kFlight; ++i) {
      cv::Mat image;
      cv::remap(cv::imread(colour(i).string()), image, x, y, cv::INTER_LINEAR);
      put_image(colour(i), image);
      cv::remap(cv::imread(depth(i).string(), cv::IMREAD_UNCHANGED), image, x, y, cv::INTER_NEAREST);
      put_image(depth(i), image);
    }
  }

  std::string settings(const std::string& lens) const {
    return file(
        "width: 512\nheight: 384\nfx: 330\nfy: 330\ncx: 255.5\ncy: 191.5\ndepth_units_per_metre: 1000\n" +
        lens);
  }

  // Largest distance of the track from the truth, both relative to the first frame.
  double error_of_run() const {
    const Trajectory truth = read_trajectory(kFolder / "groundtruth.txt").trajectory;
    const Trajectory track = trajectory();
    EXPECT_EQ(track.size(), kFlight);
    double largest = 0.0;
    for (std::size_t i = 0; i < std::min(track.size(), truth.size()); ++i) {
      const SE3 expected = truth[0].T_world_camera.inverse() * truth[i].T_world_camera;
      const SE3 found = track[0].T_world_camera.inverse() * track[i].T_world_camera;
      largest = std::max(largest, (expected.translation() - found.translation()).norm());
    }
    return largest;
  }
};

TEST_F(FisheyeFlight, IsTrackedAndItsFilesKeepTheModel) {
  const std::string given = settings("model: fisheye\ndistortion: [0, 0, 0, 0]\n");
  const std::string name = given.substr(1, given.size() - 2);
  const Outcome outcome = run("--dynamic none", name);
  ASSERT_EQ(outcome.code, 0) << outcome.error;
  const double error = error_of_run();
  EXPECT_LT(error, 0.03) << "metres";
  EXPECT_EQ(report()["camera"]["model"], "fisheye");
  EXPECT_EQ(report()["camera"]["distortion"], nlohmann::json({0.0, 0.0, 0.0, 0.0}));
  const Camera of_run = recording::camera_of_run(run_);
  EXPECT_EQ(of_run.model, LensModel::kFisheye);
  const Outcome info = run_program("map info --json '" + (run_ / "map.roslam").string() + "'", scratch_);
  EXPECT_EQ(nlohmann::json::parse(info.out, nullptr, false)["camera"]["model"], "fisheye");
  // Taken for a pinhole, the same images give a worse track, so that the test above tells the models apart.
  settings("");
  fs::remove_all(run_);
  ASSERT_EQ(run("--dynamic none", name).code, 0);
  EXPECT_GT(error_of_run(), 2.0 * error);
}

}  // namespace
}  // namespace roslam::street
