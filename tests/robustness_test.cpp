// SPDX-License-Identifier: BSD-3-Clause
// Degraded sources, and the benchmark that runs sequences on them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "simulation/degraded_source.hpp"
#include "tests/benchmark_fixture.hpp"

namespace roslam {
namespace {

using nlohmann::json;
using simulation::Degradation;
using simulation::DegradedSource;

// Ten seconds of noise at 30 images a second.
class NoiseSource : public FrameSource {
 public:
  NoiseSource() : image_(48, 80, CV_8UC3) { cv::RNG(3).fill(image_, cv::RNG::UNIFORM, 0, 256); }

  std::optional<Frame> next() override {
    if (next_ == kFrames) return std::nullopt;
    Frame frame;
    frame.index = next_++;
    frame.timestamp = 100.0 + static_cast<double>(frame.index) / 30.0;
    frame.colour = image_;
    frame.inertial.push_back({frame.timestamp});
    return frame;
  }
  const Camera& camera() const override { return camera_; }
  std::optional<std::size_t> size() const override { return kFrames; }

  const cv::Mat& image() const { return image_; }

  static constexpr std::size_t kFrames = 300;

 private:
  cv::Mat image_;
  Camera camera_;
  std::size_t next_ = 0;
};

std::vector<Frame> frames_of(Degradation degradation) {
  DegradedSource source(std::make_unique<NoiseSource>(), degradation);
  std::vector<Frame> frames;
  while (auto frame = source.next()) frames.push_back(*frame);
  EXPECT_EQ(source.size().value_or(frames.size()), frames.size());
  return frames;
}

double variance(const cv::Mat& image) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(image, mean, deviation);
  return deviation[0] * deviation[0];
}

TEST(DegradedSource, TakesEachNthImageAsItIs) {
  const cv::Mat image = NoiseSource().image();
  std::size_t n = 2;
  for (const auto degradation :
       {Degradation::kEvery2, Degradation::kEvery3, Degradation::kEvery4, Degradation::kEvery5}) {
    const auto frames = frames_of(degradation);
    ASSERT_EQ(frames.size(), (NoiseSource::kFrames + n - 1) / n);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      EXPECT_EQ(frames[i].index, i * n);
      EXPECT_EQ(frames[i].inertial.size(), i == 0 ? 1U : n);  // those of missing images as well
      EXPECT_EQ(cv::norm(frames[i].colour, image, cv::NORM_INF), 0.0);
    }
    ++n;
  }
}

TEST(DegradedSource, BlursAThirdOfTheImages) {
  const double sharp = variance(NoiseSource().image());
  std::size_t blurred = 0;
  for (const Frame& frame : frames_of(Degradation::kBlur)) {
    const double now = variance(frame.colour);
    blurred += now < 0.7 * sharp ? 1 : 0;
    EXPECT_TRUE(now < 0.7 * sharp || now == sharp) << frame.index;
  }
  EXPECT_EQ(blurred, NoiseSource::kFrames / 3);
}

TEST(DegradedSource, StepsTheExposure) {
  const cv::Mat image = NoiseSource().image();
  const auto frames = frames_of(Degradation::kExposure);
  ASSERT_EQ(frames.size(), NoiseSource::kFrames);
  const double mean = cv::mean(image)[0];
  EXPECT_EQ(cv::mean(frames[0].colour)[0], mean);
  EXPECT_NEAR(cv::mean(frames[25].colour)[0], 0.5 * mean, 1.0);
  EXPECT_GT(cv::mean(frames[45].colour)[0], 1.2 * mean);
}

TEST(DegradedSource, LeavesOutBursts) {
  std::vector<double> gaps;
  const auto frames = frames_of(Degradation::kBursts);
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const double gap = frames[i].timestamp - frames[i - 1].timestamp;
    if (gap > 0.05) gaps.push_back(gap);
  }
  ASSERT_EQ(gaps.size(), 3U);
  const double expected[] = {0.2, 0.5, 1.0};
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(gaps[i], expected[i], 0.07) << i;
}

TEST(DegradedSource, NamesAreReadBack) {
  for (const std::string& name : simulation::degradation_names())
    EXPECT_EQ(simulation::name_of(*simulation::degradation_from(name)), name);
  EXPECT_FALSE(simulation::degradation_from("fog"));
}

class BenchmarkRobustness : public BenchmarkTest {};

TEST_F(BenchmarkRobustness, CountsWrongFramesUnderEachCondition) {
  const auto result = roslam(
      "benchmark robustness --frames 30 --conditions none every-3 half-features --quiet --out results "
      "--json");
  ASSERT_EQ(result.code, 0) << result.error;
  const json report = json::parse(result.out);
  EXPECT_EQ(report, json::parse(content(folder_ / "results/benchmark.json")));
  const json& conditions = report["sequences"][0]["conditions"];
  EXPECT_EQ(report["sequences"][0]["dynamic"], "none");
  EXPECT_EQ(conditions["none"]["median"]["frames"], 30);
  EXPECT_EQ(conditions["every-3"]["median"]["frames"], 10);
  for (const char* condition : {"none", "every-3", "half-features"}) {
    EXPECT_EQ(conditions[condition]["median"]["wrong_frames"], 0) << condition;
    EXPECT_EQ(conditions[condition]["median"]["tracked_share"], 1) << condition;
  }
  EXPECT_LT(conditions["half-features"]["median"]["landmarks"], conditions["none"]["median"]["landmarks"]);
  EXPECT_NE(content(folder_ / "results/benchmark.md").find("| every-3 "), std::string::npos);
  EXPECT_EQ(roslam("benchmark robustness --conditions fog --out results").code, 2);
}

}  // namespace
}  // namespace roslam
