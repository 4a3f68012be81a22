// SPDX-License-Identifier: BSD-3-Clause
// A person fills the first second: the map must not start on what moves.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "roslam/semantics/segmenter.hpp"
#include "roslam/slam/slam.hpp"
#include "tests/street.hpp"

namespace roslam::street {
namespace {

constexpr std::uint8_t kPerson = 11;  // Cityscapes train id
constexpr std::size_t kCovered = 30;  // frames
constexpr float kNear = 0.8F;         // metres

// Labels what is nearer than a metre, or everything.
class ByDepth : public Segmenter {
 public:
  explicit ByDepth(bool labels_everything) : labels_everything_(labels_everything) {}

  void show(const cv::Mat& depth) {
    labels_ = (depth > 0.0F) & (depth < 1.0F) & kPerson;
    if (labels_everything_ && cv::countNonZero(labels_) > 0) labels_.setTo(kPerson);
  }

  Segmentation segment(const cv::Mat&) override {
    Segmentation result;
    result.labels = labels_.clone();
    result.confidence[kPerson] = 0.9F;
    return result;
  }

 private:
  bool labels_everything_;
  cv::Mat labels_;
};

// A textured surface near the camera that moves sideways.
void cover(Frame& frame, double share) {
  const int width = static_cast<int>(share * frame.colour.cols);
  cv::Mat texture(frame.colour.rows, width, CV_8UC3);
  cv::RNG random(5);
  for (int y = 0; y < texture.rows; y += 12) {
    for (int x = 0; x < texture.cols; x += 12) {
      const cv::Rect square = cv::Rect(x, y, 12, 12) & cv::Rect({}, texture.size());
      texture(square) = cv::Scalar(random.uniform(0, 256), random.uniform(0, 256), random.uniform(0, 256));
    }
  }
  const int left = static_cast<int>(2 * frame.index) % (frame.colour.cols - width + 1);
  const cv::Rect at(left, 0, width, frame.colour.rows);
  texture.copyTo(frame.colour(at));
  frame.depth(at) = kNear;
}

struct Outcome {
  std::size_t first_pose = 0;
  std::size_t poses = 0;
  std::size_t submaps = 0;
  double error = 0.0;  // metres, largest of the poses
};

Outcome run(double share, bool labels_everything, double max_wait = 3.0) {
  const auto segmenter = std::make_shared<ByDepth>(labels_everything);
  Options options;
  options.tracker.max_wait_to_start = max_wait;
  Slam slam(*camera_preset("simulated"), options, Mode::kDeterministic, segmenter);
  Outcome outcome;
  SE3 T_truth_map;
  for (Frame frame : frames()) {
    if (frame.index >= kBeforeGap) break;
    frame.colour = frame.colour.clone();
    frame.depth = frame.depth.clone();
    if (frame.index < kCovered) cover(frame, share);
    segmenter->show(frame.depth);
    const FrameResult result = slam.process(frame);
    if (!result.T_world_camera) continue;
    if (outcome.poses++ == 0) {
      outcome.first_pose = frame.index;
      T_truth_map = *frame.T_world_camera * result.T_world_camera->inverse();
    }
    const SE3 error = frame.T_world_camera->inverse() * T_truth_map * *result.T_world_camera;
    outcome.error = std::max(outcome.error, error.translation().norm());
  }
  slam.finish();
  outcome.submaps = slam.saved_map().map.submaps().size();
  return outcome;
}

TEST(MapStart, WaitsUntilMovableObjectsDoNotFillTheImage) {
  const Outcome outcome = run(0.8, true);
  EXPECT_EQ(outcome.first_pose, kCovered);
  EXPECT_EQ(outcome.poses, kBeforeGap - kCovered);
  EXPECT_EQ(outcome.submaps, 1u);
  EXPECT_LT(outcome.error, 0.1);
}

TEST(MapStart, DoesNotWaitWhereEnoughIsLeft) {
  for (const double share : {0.3, 0.8}) {
    const Outcome outcome = run(share, false);
    EXPECT_EQ(outcome.first_pose, 0u) << share;
    EXPECT_LT(outcome.error, 0.1) << "the map started on the object";
  }
}

TEST(MapStart, TheWaitIsBounded) {
  const std::size_t first = run(0.8, true, 0.5).first_pose;
  EXPECT_GE(first, 15u);
  EXPECT_LE(first, 16u);
}

}  // namespace
}  // namespace roslam::street
