// SPDX-License-Identifier: BSD-3-Clause
// Labels of every third frame only, carried in between: two runs agree to the last bit.
#include <gtest/gtest.h>

#include <memory>
#include <opencv2/imgproc.hpp>

#include "roslam/semantics/segmenter.hpp"
#include "roslam/slam/slam.hpp"
#include "tests/street_frames.hpp"

namespace roslam::street {
namespace {

constexpr std::uint8_t kPersonLabel = 11;
constexpr std::size_t kLabelEvery = 3;
const cv::Scalar kCoat(40, 60, 170);

// A person in a striped coat who walks by at 3 m, 4 pixels a frame.
cv::Rect walker(std::size_t frame) { return {150 + 4 * static_cast<int>(frame), 120, 110, 300}; }

Frame with_walker(const Frame& street) {
  Frame frame = street;
  frame.colour = street.colour.clone();
  frame.depth = street.depth.clone();
  const cv::Rect box = walker(frame.index);
  frame.colour(box).setTo(kCoat);
  for (int y = 10; y < box.height; y += 24) {
    for (int x = 10 + y % 7; x < box.width; x += 17) {
      frame.colour(cv::Rect(box.x + x, box.y + y, std::min(9, box.width - x), 11))
          .setTo(cv::Scalar::all(230));
    }
  }
  frame.depth(box).setTo(3.0F);
  return frame;
}

// Finds the coat and what lies within its bounds.
class FindsCoat : public Segmenter {
 public:
  Segmentation segment(const cv::Mat& image) override {
    ++calls;
    Segmentation result;
    cv::Mat is_coat;
    cv::inRange(image, kCoat, kCoat, is_coat);
    result.labels = cv::Mat::zeros(image.size(), CV_8UC1);
    result.labels(cv::boundingRect(is_coat)).setTo(kPersonLabel);
    result.confidence.fill(0.9F);
    return result;
  }

  std::size_t calls = 0;
};

struct Flight {
  std::vector<FrameResult> results;
  Trajectory trajectory;
};

class LabelEvery : public Street {
 protected:
  static Flight fly() {
    Options options;
    options.dynamic_objects.label_every = static_cast<int>(kLabelEvery);
    const auto segmenter = std::make_shared<FindsCoat>();
    Slam slam(*camera_preset("simulated"), options, Mode::kDeterministic, segmenter);
    Flight outcome;
    for (std::size_t i = 0; i < kFrameCount; ++i) {
      auto result = slam.process(with_walker(frames_->at(i)));
      EXPECT_TRUE(result.is_used());
      outcome.results.push_back(std::move(result));
    }
    slam.finish();
    EXPECT_EQ(segmenter->calls, kFrameCount / kLabelEvery);
    EXPECT_TRUE(slam.labelling_faults().empty());
    outcome.trajectory = slam.trajectory();
    return outcome;
  }

  static bool is_same(const cv::Mat& a, const cv::Mat& b) {
    return a.size() == b.size() && (a.empty() || cv::norm(a, b, cv::NORM_INF) == 0.0);
  }

  static constexpr std::size_t kFrameCount = 36;
};

TEST_F(LabelEvery, GivesTheSameBitsAgain) {
  const Flight one = fly();
  const Flight two = fly();
  ASSERT_EQ(one.trajectory.size(), kFrameCount);
  ASSERT_EQ(two.trajectory.size(), kFrameCount);
  for (std::size_t i = 0; i < kFrameCount; ++i) {
    EXPECT_EQ(one.trajectory[i].timestamp, two.trajectory[i].timestamp);
    EXPECT_EQ(one.trajectory[i].T_world_camera.matrix(), two.trajectory[i].T_world_camera.matrix()) << i;
    const DynamicObjects& a = one.results[i].dynamic_objects;
    const DynamicObjects& b = two.results[i].dynamic_objects;
    EXPECT_TRUE(is_same(a.mask, b.mask)) << i;
    EXPECT_TRUE(is_same(a.resting, b.resting)) << i;
    EXPECT_EQ(a.label_age, b.label_age) << i;
    ASSERT_EQ(a.objects.size(), b.objects.size()) << i;
    for (std::size_t k = 0; k < a.objects.size(); ++k) {
      EXPECT_EQ(a.objects[k].id, b.objects[k].id);
      EXPECT_EQ(a.objects[k].box, b.objects[k].box);
      EXPECT_TRUE(is_same(a.objects[k].mask, b.objects[k].mask)) << i;
    }
    EXPECT_EQ(one.results[i].points, two.results[i].points) << i;
  }
}

TEST_F(LabelEvery, ThingsAreRemovedInTheFramesBetween) {
  const Flight outcome = fly();
  for (std::size_t i = 0; i < kFrameCount; ++i) {
    const DynamicObjects& removal = outcome.results[i].dynamic_objects;
    EXPECT_EQ(removal.label_age, static_cast<int>(i % kLabelEvery)) << i;
    ASSERT_FALSE(removal.mask.empty()) << i;
    const cv::Mat on_walker = removal.mask(walker(i));
    EXPECT_GT(cv::countNonZero(on_walker), walker(i).area() * 95 / 100) << i;
    for (const auto& point : outcome.results[i].points)
      EXPECT_FALSE(cv::Rect2f(walker(i)).contains(point)) << i;
  }
}

}  // namespace
}  // namespace roslam::street
