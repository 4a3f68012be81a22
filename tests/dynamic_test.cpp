// SPDX-License-Identifier: BSD-3-Clause
// No features on areas labelled movable; a run without a network reports that and continues.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "roslam/semantics/segmenter.hpp"
#include "roslam/slam/run.hpp"
#include "tests/street.hpp"

namespace roslam::street {
namespace {

constexpr int kBorder = 250;  // pixels; what is left of it counts as a person

class LeftIsPerson : public Segmenter {
 public:
  Segmentation segment(const cv::Mat& image) override {
    Segmentation result;
    result.labels = cv::Mat::zeros(image.size(), CV_8UC1);
    result.labels.colRange(0, kBorder) = 11;
    result.seconds = 0.001;
    return result;
  }
};

TEST(DynamicObjects, NoPointOfTheMapLiesOnWhatMayMove) {
  TumSource source(kFolder, *camera_preset("simulated"));
  Options options;
  options.dynamic_objects = *options_of_mode("labels");
  Slam slam(source.camera(), options, Mode::kDeterministic, std::make_shared<LeftIsPerson>());
  double removed = 0.0;
  const RunSummary summary = run_slam(source, slam, [&](const Frame&, const FrameResult& result) {
    removed += cv::countNonZero(result.dynamic_objects.mask);
  });
  ASSERT_FALSE(summary.failure);
  EXPECT_GT(slam.trajectory().size(), 50U);
  std::size_t points = 0;
  float leftmost = 1e9F;
  for (const KeyframeId id : slam.map().keyframe_ids()) {
    for (const auto& pixel : slam.map().find(id)->view->pixels) {
      leftmost = std::min(leftmost, pixel.x());
      ++points;
    }
  }
  EXPECT_GT(points, 1000U);
  EXPECT_GE(leftmost, static_cast<float>(kBorder));
  const double pixels = static_cast<double>(slam.frames()) * source.camera().width * source.camera().height;
  EXPECT_NEAR(removed / pixels, static_cast<double>(kBorder) / source.camera().width, 0.03);
  EXPECT_EQ(slam.times().summary().at("segmentation").count, slam.frames());
}

class DynamicRun : public Dataset {
 protected:
  const std::string kColours = "--dynamic labels --model '" ROSLAM_TEST_FILES "/colours.onnx'";
};

TEST_F(DynamicRun, LabelsFramesAndReportsIt) {
  const auto frames = frames_of_run(kColours);
  const auto json = report();
  EXPECT_EQ(json["dynamic"]["mode"], "labels");
  EXPECT_EQ(json["processor_milliseconds"]["segmentation"]["count"], frames["processed"]);
  frames_of_run(kColours + " --real-time");
  EXPECT_EQ(report()["dynamic"]["mode"], "labels");
  frames_of_run("--dynamic none");
  EXPECT_EQ(report()["dynamic"]["mode"], "none");
  EXPECT_FALSE(report()["processor_milliseconds"].contains("segmentation"));
}

TEST_F(DynamicRun, RefusesABadModelAndUnknownModes) {
  expect_refused(run("--dynamic labels --model '" ROSLAM_TEST_FILES "/eleven.onnx'"),
                 {"eleven.onnx", "11 classes"});
  expect_refused(run("--dynamic labels --model none.onnx"), {"none.onnx: no such model file"});
  EXPECT_EQ(run("--dynamic magic").code, 2);
  const Outcome unused = run("--dynamic geometry --model none.onnx");
  EXPECT_EQ(unused.code, 2);
  EXPECT_NE(unused.error.find("--model: needs --dynamic labels or both"), std::string::npos) << unused.error;
}

TEST_F(DynamicRun, WithoutWeightsItSaysOnceThatNothingIsRemoved) {
  const fs::path alone = scratch_ / "alone";
  fs::create_directories(alone);
  fs::copy_file(ROSLAM_PROGRAM, alone / "roslam");
  const auto run_alone = [&](const std::string& arguments) {
    return shell_in(scratch_, "alone/roslam run data --quiet --camera simulated --out run " + arguments);
  };
  const Outcome outcome = run_alone("--dynamic labels --no-loops");
  EXPECT_EQ(outcome.code, 0) << outcome.error;
  EXPECT_NE(outcome.error.find("roslam-pspnet.onnx: not found"), std::string::npos) << outcome.error;
  EXPECT_NE(outcome.error.find("not removed"), std::string::npos) << outcome.error;
  EXPECT_EQ(std::count(outcome.error.begin(), outcome.error.end(), '\n'), 1) << outcome.error;
  EXPECT_EQ(report()["dynamic"]["mode"], "none");
  EXPECT_EQ(trajectory().size(), kFrames);
  EXPECT_EQ(run_alone("--dynamic none --no-loops").error, "");
  const Outcome without_words = run_alone("--dynamic none");
  EXPECT_EQ(without_words.code, 0);
  EXPECT_NE(without_words.error.find("roslam-orb.vocabulary: not found"), std::string::npos);
  EXPECT_EQ(std::count(without_words.error.begin(), without_words.error.end(), '\n'), 1);
}

}  // namespace
}  // namespace roslam::street
