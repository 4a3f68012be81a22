// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <opencv2/imgproc.hpp>

#include "evaluation/camera_check/stereo_check.hpp"
#include "roslam/common/error.hpp"
#include "roslam/datasets/dataset.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam::evaluation {
namespace {

// Pairs of the simulated street, each five times, as the check takes every fifth; changed by a function.
class ChangedPairs : public FrameSource {
 public:
  using Change = std::function<void(cv::Mat& left, cv::Mat& right)>;
  explicit ChangedPairs(Change change) : change_(std::move(change)) {}

  std::optional<Frame> next() override {
    constexpr std::size_t kTimes = 5;
    if (at_ >= kTimes * rendered().size()) return std::nullopt;
    Frame frame = rendered()[at_ / kTimes];
    frame.index = at_++;
    cv::Mat left;
    cv::cvtColor(frame.colour, left, cv::COLOR_BGR2GRAY);
    change_(left, frame.right);
    frame.colour = cv::Mat();  // the rendered one is for all tests
    cv::cvtColor(left, frame.colour, cv::COLOR_GRAY2BGR);
    return frame;
  }
  using FrameSource::next;
  const Camera& camera() const override { return simulator().camera(); }

 private:
  static simulation::Simulator& simulator() {
    static simulation::Simulator simulator = [] {
      simulation::SimulatorOptions options;
      options.stereo = true;
      return simulation::Simulator(options);
    }();
    return simulator;
  }
  static const std::vector<Frame>& rendered() {
    static const std::vector<Frame> frames = [] {
      std::vector<Frame> all;
      for (std::size_t i = 0; i < 400; i += 50) all.push_back(simulator().render(i).frame);
      return all;
    }();
    return frames;
  }

  Change change_;
  std::size_t at_ = 0;
};

StereoCheck check(const ChangedPairs::Change& change) {
  ChangedPairs source(change);
  return check_stereo(source, "pairs", [](std::size_t, std::size_t) {}, {});
}

// The image turned about its centre (degrees) and moved down (pixels).
cv::Mat moved(const cv::Mat& image, double turn, double down) {
  cv::Mat matrix = cv::getRotationMatrix2D(cv::Point2f(319.5F, 239.5F), turn, 1.0), result;
  matrix.at<double>(1, 2) += down;
  cv::warpAffine(image, result, matrix, image.size());
  return result;
}

TEST(StereoCheck, RightPairsFit) {
  const StereoCheck found = check([](cv::Mat&, cv::Mat&) {});
  EXPECT_EQ(found.order.verdict, Verdict::kFits) << found.order.words;
  EXPECT_EQ(found.rows.verdict, Verdict::kFits) << found.rows.words;
  EXPECT_LT(found.worst, 0.4);
  EXPECT_EQ(found.pairs, 8U);
}

TEST(StereoCheck, FindsSwappedImages) {
  const StereoCheck found = check([](cv::Mat& left, cv::Mat& right) { cv::swap(left, right); });
  EXPECT_EQ(found.order.verdict, Verdict::kDoesNotFit);
  EXPECT_NE(found.order.remedy.find("swapped"), std::string::npos);
}

TEST(StereoCheck, FindsRowsThatDoNotCorrespond) {
  const StereoCheck lower = check([](cv::Mat&, cv::Mat& right) { right = moved(right, 0.0, 2.5); });
  EXPECT_EQ(lower.order.verdict, Verdict::kFits);
  EXPECT_EQ(lower.rows.verdict, Verdict::kDoesNotFit) << lower.rows.words;
  EXPECT_NEAR(lower.offset, 2.5, 0.2);
  // 0.4 degrees move the corners, 320 pixels beside the centre, by 2.2 pixels.
  const StereoCheck turned = check([](cv::Mat&, cv::Mat& right) { right = moved(right, 0.4, 0.0); });
  EXPECT_EQ(turned.rows.verdict, Verdict::kDoesNotFit) << turned.rows.words;
  EXPECT_NEAR(turned.worst, 320.0 * 0.4 * M_PI / 180.0, 0.5);
}

TEST(StereoCheck, CannotTellWithoutTexture) {
  const StereoCheck found = check(
      [](cv::Mat& left, cv::Mat& right) { left = right = cv::Mat(left.size(), CV_8UC1, cv::Scalar(90)); });
  EXPECT_EQ(found.order.verdict, Verdict::kCannotTell);
  EXPECT_EQ(found.rows.verdict, Verdict::kCannotTell);
}

TEST(StereoCheck, NeedsPairs) {
  EXPECT_THROW(check([](cv::Mat&, cv::Mat& right) { right.release(); }), InputError);
}

TEST(StereoCheck, RecordingsFit) {
  for (const char* name : {"euroc_mh01", "kitti06_stereo"}) {
    const auto folder = std::filesystem::path(ROSLAM_TEST_DATA) / "slam" / name;
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not at hand";
    const auto source = open_dataset(folder, {});
    const StereoCheck found = check_stereo(*source, name, [](std::size_t, std::size_t) {}, {});
    EXPECT_TRUE(found.fits()) << found.order.words << "; " << found.rows.words;
    EXPECT_EQ(found.order.verdict, Verdict::kFits) << found.order.words;
  }
}

}  // namespace
}  // namespace roslam::evaluation
