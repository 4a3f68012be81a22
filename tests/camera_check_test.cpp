// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/camera_check/camera_check.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <random>
#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/datasets/dataset.hpp"
#include "simulation/faulty_camera_source.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam::evaluation {
namespace {

using simulation::CameraFault;
using simulation::FaultyCameraSource;

// Frames in memory, which several checks read.
class StoredSource : public FrameSource {
 public:
  StoredSource(const std::vector<Frame>& frames, const Camera& camera) : frames_(frames), camera_(camera) {}
  std::optional<Frame> next() override {
    return next_ < frames_.size() ? std::make_optional(frames_[next_++]) : std::nullopt;
  }
  const Camera& camera() const override { return camera_; }
  std::optional<std::size_t> size() const override { return frames_.size(); }

 private:
  const std::vector<Frame>& frames_;
  Camera camera_;
  std::size_t next_ = 0;
};

struct Recording {
  std::vector<Frame> frames;
  Camera camera;

  CameraCheck check(const std::vector<CameraFault>& faults = {}) const {
    FaultyCameraSource source(std::make_unique<StoredSource>(frames, camera), faults);
    return check_camera(source, "recording", {}, [](std::size_t, std::size_t) {}, {});
  }
};

Recording read(FrameSource& source) {
  Recording recording{{}, source.camera()};
  while (auto frame = source.next()) recording.frames.push_back(*frame);
  return recording;
}

Recording flight(simulation::FlightPath path, std::size_t frames, std::uint32_t seed, double gusts) {
  simulation::SimulatorOptions options;
  options.path = path;
  options.frames = frames;
  options.seed = seed;
  options.gusts = gusts;
  simulation::SimulatedSource source(options);
  return read(source);
}

// An image of boxes before a wall that moves by five pixels a frame, to one side and back. No rigid scene
// moves so, near and far alike: it tells nothing of the lens.
Recording panned_boxes() {
  std::mt19937 random(3);
  const auto pick = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
  cv::Mat colour(480, 1600, CV_8UC3, cv::Scalar(128, 128, 128)), depth(480, 1600, CV_32FC1, cv::Scalar(3.0));
  for (int box = 0; box < 60; ++box) {
    const cv::Rect at(pick(0, 1400), pick(0, 300), pick(60, 160), pick(60, 160));
    depth(at) = 1.0 + 0.02 * box;
    colour(at) = cv::Scalar::all(pick(30, 220));
  }
  Recording recording;
  recording.camera.depth_units_per_metre = 1000.0;
  for (int i = 0; i < 200; ++i) {
    const cv::Rect window(5 * (i < 100 ? i + 20 : 219 - i), 0, 640, 480);
    Frame frame;
    frame.index = static_cast<std::size_t>(i);
    frame.timestamp = i / 30.0;
    frame.colour = colour(window).clone();
    frame.depth = depth(window).clone();
    recording.frames.push_back(frame);
  }
  return recording;
}

std::string words_of(const CameraCheck& check) {
  std::string words;
  for (const CameraFinding* finding :
       {&check.depth_scale, &check.registration, &check.timing, &check.distortion})
    words += std::string(name_of(finding->verdict)) + ": " + finding->words + " " + finding->remedy + "\n";
  return words;
}

void expect_clean(const Recording& recording, const std::string& name) {
  const CameraCheck check = recording.check();
  EXPECT_TRUE(check.fits()) << name << "\n" << words_of(check);
}

void expect_misfits(const CameraCheck& check, const std::vector<CameraFinding CameraCheck::*>& expected) {
  for (const auto finding : {&CameraCheck::depth_scale, &CameraCheck::registration, &CameraCheck::timing,
                             &CameraCheck::distortion}) {
    const bool is_expected = std::find(expected.begin(), expected.end(), finding) != expected.end();
    EXPECT_EQ((check.*finding).verdict == Verdict::kDoesNotFit, is_expected) << words_of(check);
    EXPECT_EQ((check.*finding).remedy.empty(), !is_expected) << words_of(check);
    EXPECT_FALSE((check.*finding).words.empty());
  }
}

// Faults that every recording with motion tells, one by one and together.
void expect_faults_found(const Recording& recording) {
  const auto scale = &CameraCheck::depth_scale, registration = &CameraCheck::registration,
             timing = &CameraCheck::timing;
  const CameraCheck large = recording.check({CameraFault::kDepthTooLarge});
  expect_misfits(large, {scale});
  ASSERT_TRUE(large.scale);
  EXPECT_NEAR(large.scale->mean, 5.0, 0.5);
  EXPECT_NE(large.depth_scale.remedy.find("depth_units_per_metre 1000"), std::string::npos)
      << large.depth_scale.remedy;
  const CameraCheck small = recording.check({CameraFault::kDepthTooSmall});
  expect_misfits(small, {scale});
  EXPECT_NEAR(small.scale->mean, 0.2, 0.02);
  const CameraCheck plain = recording.check({CameraFault::kPlainDepth});
  expect_misfits(plain, {registration});
  EXPECT_NEAR(plain.edges->zoom.mean, 613.0 / 390.0, 0.03);
  const CameraCheck late = recording.check({CameraFault::kLateDepth});
  expect_misfits(late, {timing});
  EXPECT_NEAR(late.edges->lag.mean, 2.0, 0.3);
  const CameraCheck early = recording.check({CameraFault::kEarlyDepth, CameraFault::kDepthTooLarge});
  expect_misfits(early, {timing, scale});
  EXPECT_NEAR(early.edges->lag.mean, -2.0, 0.3);
  expect_misfits(recording.check({CameraFault::kPlainDepth, CameraFault::kLateDepth}),
                 {registration, timing});
}

void expect_lens_faults_found(const Recording& recording) {
  const auto distortion = &CameraCheck::distortion;
  const CameraCheck right = recording.check({CameraFault::kDistorted});
  expect_misfits(right, {});
  const CameraCheck none = recording.check({CameraFault::kNoDistortion});
  expect_misfits(none, {distortion});
  EXPECT_NEAR(none.as_given.k1.mean, -0.12, 0.025) << words_of(none);
  const CameraCheck inverse = recording.check({CameraFault::kInverseDistortion});
  expect_misfits(inverse, {distortion});
  EXPECT_NE(inverse.distortion.remedy.find("negate"), std::string::npos) << words_of(inverse);
}

TEST(CameraCheck, MeasuresShiftAndLagOfKnownImages) {
  Recording boxes = panned_boxes();
  const CameraCheck clean = boxes.check();
  EXPECT_EQ(clean.registration.verdict, Verdict::kFits) << words_of(clean);
  EXPECT_EQ(clean.timing.verdict, Verdict::kFits) << words_of(clean);
  ASSERT_TRUE(clean.edges);
  EXPECT_NEAR(clean.edges->lag.mean, 0.0, 0.1);
  EXPECT_NEAR(clean.edges->x.mean, 0.0, 0.5);
  EXPECT_NEAR(clean.edges->y.mean, 0.0, 0.5);
  const CameraCheck late = boxes.check({CameraFault::kLateDepth});
  EXPECT_EQ(late.registration.verdict, Verdict::kFits) << words_of(late);
  EXPECT_EQ(late.timing.verdict, Verdict::kDoesNotFit) << words_of(late);
  EXPECT_NEAR(late.edges->lag.mean, 2.0, 0.1);
  EXPECT_NE(late.timing.words.find("67 ms"), std::string::npos) << late.timing.words;
  for (Frame& frame : boxes.frames) {
    const cv::Mat move = (cv::Mat_<double>(2, 3) << 1.0, 0.0, 12.0, 0.0, 1.0, 1.0);
    cv::Mat moved;
    cv::warpAffine(frame.depth, moved, move, frame.depth.size(), cv::INTER_NEAREST);
    frame.depth = moved;
  }
  const CameraCheck shifted = boxes.check();
  EXPECT_EQ(shifted.registration.verdict, Verdict::kDoesNotFit) << words_of(shifted);
  EXPECT_EQ(shifted.timing.verdict, Verdict::kFits) << words_of(shifted);
  EXPECT_NEAR(shifted.edges->x.mean, -12.0, 1.0);
  EXPECT_NEAR(shifted.edges->y.mean, -1.0, 1.0);
}

TEST(CameraCheck, CannotTellWhatARestingCameraDoesNotShow) {
  Recording resting = panned_boxes();
  for (Frame& frame : resting.frames) {
    frame.colour = resting.frames.front().colour;
    frame.depth = resting.frames.front().depth;
  }
  const CameraCheck check = resting.check({CameraFault::kLateDepth});
  expect_misfits(check, {});
  EXPECT_EQ(check.timing.verdict, Verdict::kCannotTell) << words_of(check);
  for (Frame& frame : resting.frames) frame.depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(2.0));
  const CameraCheck flat = resting.check();
  EXPECT_FALSE(flat.edges);
  EXPECT_EQ(flat.registration.verdict, Verdict::kCannotTell);
}

// Points at random in front of two poses, seen by a lens that is known.
std::vector<TrackedPair> pairs_of(const Camera& camera) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.3);
  std::vector<TrackedPair> pairs;
  for (std::size_t run = 0; run < 12; ++run) {
    TrackedPair pair;
    pair.run = run;
    pair.size = {camera.width, camera.height};
    const double z = 2.0 + 0.1 * static_cast<double>(run);
    for (cv::Mat& depth : pair.depths) depth = cv::Mat(120, 160, CV_32FC1, cv::Scalar(z));
    const SE3 T(so3_exp(0.15 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random))),
                0.2 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random)));
    for (int i = 0; i < 300; ++i) {
      const Eigen::Vector2d from(320.0 + 310.0 * uniform(random), 240.0 + 230.0 * uniform(random));
      const Eigen::Vector3d moved = T * camera.unproject(camera.undistort(from), z);
      const Eigen::Vector2d to = camera.distort(camera.project(moved));
      if (to.x() < 0.0 || to.y() < 0.0 || to.x() > 639.0 || to.y() > 479.0) continue;
      pair.from.push_back(from);
      pair.to.emplace_back(to.x() + noise(random), to.y() + noise(random));
    }
    pair.T_to_from = T;
    pairs.push_back(pair);
  }
  return pairs;
}

TEST(LensFit, FindsTheRadialCoefficientThatIsMissing) {
  Camera lens, pinhole;
  lens.set_lens("pinhole", {-0.15, 0.0});
  const std::vector<TrackedPair> pairs = pairs_of(lens);
  const LensFit right = fit_lens(lens, LensReading::kAsGiven, pairs, {}, {});
  EXPECT_LT(right.error, 0.6);
  EXPECT_LT(std::abs(right.k1.mean), 5.0 * right.k1.sigma);
  EXPECT_LT(right.k1.sigma, 0.005);
  for (std::size_t i = 0; i < pairs.size(); ++i)
    EXPECT_LT((right.T_to_from[i].translation() - pairs[i].T_to_from->translation()).norm(), 0.01);
  const LensFit missing = fit_lens(pinhole, LensReading::kAsGiven, pairs, {}, {});
  EXPECT_NEAR(missing.k1.mean, -0.15, 0.015);
  EXPECT_GT(missing.error, 2.0 * missing.free_error);
  EXPECT_NEAR(fit_lens(lens, LensReading::kNone, pairs, {}, {}).k1.mean, missing.k1.mean, 1e-6);
  Camera opposite;
  opposite.set_lens("pinhole", {0.15, 0.0});
  const LensFit inverse = fit_lens(opposite, LensReading::kInverse, pairs, {}, {});
  const LensFit wrong = fit_lens(opposite, LensReading::kAsGiven, pairs, {}, {});
  EXPECT_EQ(inverse.pairs, pairs.size());
  EXPECT_EQ(wrong.pairs, pairs.size());
  EXPECT_LT(inverse.error, 0.7 * wrong.error) << inverse.points << " and " << wrong.points;
}

TEST(CameraCheck, FindsFaultsOfAFlight) {
  const Recording hover = flight(simulation::FlightPath::kHover, 100, 5, 1.0);
  expect_clean(hover, "hover");
  expect_faults_found(hover);
}

TEST(CameraCheck, FindsNothingWrongWithOtherFlights) {
  expect_clean(flight(simulation::FlightPath::kStreet, 48, 11, 0.0), "street");
  expect_clean(flight(simulation::FlightPath::kCorridor, 48, 12, 0.5), "corridor");
}

class CameraCheckOnRecordings : public testing::Test {
 protected:
  static std::optional<Recording> recording(const std::string& name, const std::string& preset) {
    const auto folder = std::filesystem::path(ROSLAM_TEST_DATA) / "slam" / name;
    if (!std::filesystem::exists(folder / "rgb.txt")) return std::nullopt;
    return read(*open_dataset(folder, camera_preset(preset)));
  }
};

TEST_F(CameraCheckOnRecordings, FindsFaultsOfKitchen) {
  const auto kitchen = recording("kitchen", "7scenes");
  if (!kitchen) GTEST_SKIP() << "kitchen is not at hand";
  expect_clean(*kitchen, "kitchen");
  expect_faults_found(*kitchen);
  expect_misfits(kitchen->check({CameraFault::kShiftedDepth}), {&CameraCheck::registration});
  expect_lens_faults_found(*kitchen);
}

TEST_F(CameraCheckOnRecordings, FindsNothingWrongWithOthers) {
  const auto rpy = recording("fr1_rpy", "tum-fr1"), desk = recording("d435_desk", "d435");
  if (!rpy || !desk) GTEST_SKIP() << "fr1_rpy and d435_desk are not at hand";
  expect_clean(*rpy, "fr1_rpy");
  expect_clean(*desk, "d435_desk");
  expect_misfits(rpy->check({CameraFault::kInverseDistortion}), {&CameraCheck::distortion});
}

TEST(CameraCheck, RefusesWhatItCannotCompare) {
  Recording boxes = panned_boxes();
  const auto error_of = [&](const std::stop_token& stop) -> std::string {
    StoredSource source(boxes.frames, boxes.camera);
    try {
      check_camera(
          source, "boxes", {}, [](std::size_t, std::size_t) {}, stop);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  std::stop_source stop;
  stop.request_stop();
  EXPECT_NE(error_of(stop.get_token()).find("interrupted"), std::string::npos);
  boxes.frames.resize(9);
  EXPECT_NE(error_of({}).find("boxes: has no 10 consecutive frames with depth"), std::string::npos);
  for (Frame& frame : boxes.frames) frame.depth = cv::Mat();
  EXPECT_NE(error_of({}).find("no depth images"), std::string::npos);
  boxes.frames.clear();
  EXPECT_NE(error_of({}).find("no frame"), std::string::npos);
}

}  // namespace
}  // namespace roslam::evaluation
