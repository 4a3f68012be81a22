// SPDX-License-Identifier: BSD-3-Clause
// Images without features, missing or absurd depth: tracking reports loss and recovers.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <ostream>

#include "roslam/common/error.hpp"
#include "roslam/slam/run.hpp"
#include "roslam/slam/slam.hpp"
#include "tests/street_frames.hpp"

namespace roslam::street {
namespace {

struct Blank {
  const char* name;
  cv::Scalar colour;
  std::size_t count;

  friend std::ostream& operator<<(std::ostream& out, const Blank& blank) { return out << blank.name; }
};

class BlankFrames : public Street, public testing::WithParamInterface<Blank> {};

TEST_P(BlankFrames, AreReportedAsLostAndTheMapServesAgain) {
  constexpr std::size_t kGap = 25;
  const std::size_t gap_end = kGap + GetParam().count;
  Slam slam(*camera_preset("simulated"));
  std::optional<SE3> first;
  std::size_t recovered = 0;
  for (const Frame& frame : with_blank(kGap, gap_end, gap_end + 15, GetParam().colour)) {
    const auto result = slam.process(frame);
    ASSERT_TRUE(result.is_used());
    if (frame.index < kGap) {
      ASSERT_EQ(result.state, TrackingState::kTracking) << frame.index;
      if (!first) first = result.T_world_camera;
    } else if (frame.index < gap_end) {
      EXPECT_FALSE(result.T_world_camera) << frame.index;
      EXPECT_EQ(result.state, frame.index < kGap + 30 ? TrackingState::kRecentlyLost : TrackingState::kLost);
      EXPECT_EQ(result.inliers, 0);
      EXPECT_FALSE(result.is_keyframe);
    } else if (result.T_world_camera) {
      ++recovered;
      const SE3 error = truth(frame, *first).inverse() * *result.T_world_camera;
      EXPECT_LT(error.translation().norm(), 0.1) << frame.index;
      EXPECT_LT(error.angle(), 0.02) << frame.index;
    }
  }
  slam.finish();
  EXPECT_GE(recovered, 14u);
  for (const auto& pose : slam.trajectory()) {
    EXPECT_TRUE(pose.timestamp < time_of(kGap) || pose.timestamp >= time_of(gap_end)) << pose.timestamp;
  }
  EXPECT_EQ(slam.trajectory().size(), kGap + recovered);
}

INSTANTIATE_TEST_SUITE_P(
    Lengths, BlankFrames,
    testing::Values(Blank{"black10", cv::Scalar::all(0), 10}, Blank{"white10", cv::Scalar::all(255), 10},
                    Blank{"grey10", cv::Scalar::all(128), 10}, Blank{"black60", cv::Scalar::all(0), 60},
                    Blank{"white60", cv::Scalar::all(255), 60}, Blank{"grey60", cv::Scalar::all(128), 60}),
    [](const auto& tested) { return std::string(tested.param.name); });

// As an image taken while the camera shakes: rows are displaced against each other, and blurred.
cv::Mat shaken(const cv::Mat& image, double pixels) {
  cv::Mat columns(image.size(), CV_32FC1), rows(image.size(), CV_32FC1), result;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      columns.at<float>(y, x) = static_cast<float>(x + pixels * std::sin(0.05 * y));
      rows.at<float>(y, x) = static_cast<float>(y + pixels * std::cos(0.04 * y));
    }
  }
  cv::remap(image, result, columns, rows, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  cv::GaussianBlur(result, result, {}, 2.5);
  return result;
}

TEST_F(Street, APoseThatAShakenImageGivesIsNotGivenOut) {
  constexpr std::size_t kShaken = 40;
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  Slam slam(*camera_preset("simulated"), options);
  std::optional<SE3> first;
  for (const Frame& given : *frames_) {
    if (given.index > kShaken + 5) break;
    Frame frame = given;
    if (frame.index == kShaken) frame.colour = shaken(frame.colour, 4.0);
    const auto result = slam.process(frame);
    if (frame.index == kShaken) {
      EXPECT_EQ(result.state, TrackingState::kRecentlyLost);
      EXPECT_FALSE(result.T_world_camera);
      EXPECT_EQ(result.inliers, 0);
      EXPECT_FALSE(result.is_keyframe);
      EXPECT_TRUE(result.covariance.isZero());
      continue;
    }
    ASSERT_EQ(result.state, TrackingState::kTracking) << frame.index;
    if (!first) first = result.T_world_camera;
    const SE3 error = truth(frame, *first).inverse() * *result.T_world_camera;
    EXPECT_LT(error.translation().norm(), 0.05) << frame.index;
    EXPECT_LT(error.angle(), 0.01) << frame.index;
  }
  slam.finish();
  EXPECT_EQ(slam.doubted_poses().size(), 1U);
  EXPECT_EQ(slam.doubted_poses()["few of the landmarks in view are found, and not well"], 1U);
  EXPECT_EQ(slam.trajectory().size(), kShaken + 5) << "the shaken frame has no pose";
}

TEST_F(Street, TrackingGoesOnWhileDepthIsMissing) {
  Slam slam(*camera_preset("simulated"));
  std::size_t tracked = 0;
  std::optional<SE3> first;
  for (const Frame& given : *frames_) {
    if (given.index >= kBeforeGap) break;
    Frame frame = given;
    if (frame.index >= 15 && frame.index < 45) frame.depth.release();
    const auto result = slam.process(frame);
    ASSERT_TRUE(result.is_used());
    if (!result.T_world_camera) continue;
    if (!first) first = result.T_world_camera;
    ++tracked;
    EXPECT_LT((truth(given, *first).inverse() * *result.T_world_camera).translation().norm(), 0.1)
        << frame.index;
  }
  RecordProperty("tracked", static_cast<int>(tracked));
  EXPECT_EQ(tracked, kBeforeGap);
}

TEST_F(Street, AbsurdDepthIsUnknownDepth) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float infinity = std::numeric_limits<float>::infinity();
  for (const float absurd : {nan, infinity, -infinity, -3.0F, 1e30F, 1e-30F, 0.0F}) {
    Slam slam(*camera_preset("simulated"));
    for (std::size_t i = 0; i < 3; ++i) {
      Frame frame = (*frames_)[i];
      frame.depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(static_cast<double>(absurd)));
      const auto result = slam.process(frame);
      ASSERT_TRUE(result.is_used());
      EXPECT_EQ(result.state, TrackingState::kInitialising) << absurd;
    }
    EXPECT_TRUE(slam.trajectory().empty());
  }
}

TEST_F(Street, DepthThatIsPartlyAbsurdDoesNotSpoilTheRest) {
  Slam slam(*camera_preset("simulated"));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (std::size_t i = 0; i < 25; ++i) {
    Frame frame = (*frames_)[i];
    frame.depth = frame.depth.clone();
    frame.depth.colRange(0, 200).setTo(nan);
    frame.depth.rowRange(0, 100).setTo(-1.0F);
    frame.depth.colRange(600, 640).setTo(std::numeric_limits<float>::infinity());
    const auto result = slam.process(frame);
    ASSERT_TRUE(result.T_world_camera) << i;
    EXPECT_TRUE(result.T_world_camera->is_finite());
  }
  for (const LandmarkId id : slam.map().landmark_ids())
    EXPECT_TRUE(slam.map().find(id)->position.allFinite());
}

TEST_F(Street, FramesOfWrongTypeAreRefusedAndCounted) {
  Slam slam(*camera_preset("simulated"));
  const Frame good = frames_->front();
  const auto refused = [&](auto&& spoil) {
    Frame frame = good;
    spoil(frame);
    return !slam.process(frame).is_used();
  };
  EXPECT_TRUE(refused([](Frame& f) { f.colour.release(); }));
  EXPECT_TRUE(refused([](Frame& f) { f.colour = cv::Mat(480, 640, CV_8UC1, cv::Scalar(0)); }));
  EXPECT_TRUE(refused([](Frame& f) { f.colour = cv::Mat(480, 640, CV_32FC3, cv::Scalar(0)); }));
  EXPECT_TRUE(refused([](Frame& f) { f.colour = cv::Mat(240, 320, CV_8UC3, cv::Scalar(0)); }));
  EXPECT_TRUE(refused([](Frame& f) { f.depth = cv::Mat(480, 640, CV_16UC1, cv::Scalar(0)); }));
  EXPECT_TRUE(refused([](Frame& f) { f.depth = cv::Mat(480, 640, CV_64FC1, cv::Scalar(0)); }));
  EXPECT_TRUE(refused([](Frame& f) { f.depth = cv::Mat(240, 320, CV_32FC1, cv::Scalar(0)); }));
  EXPECT_TRUE(refused([](Frame& f) { f.timestamp = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](Frame& f) { f.timestamp = std::numeric_limits<double>::infinity(); }));
  EXPECT_FALSE(refused([](Frame&) {}));
  EXPECT_TRUE(refused([](Frame&) {}));  // the same time again
  EXPECT_TRUE(refused([](Frame& f) { f.timestamp -= 0.5; }));
  std::size_t count = 0;
  for (const auto& [reason, number] : slam.rejected()) count += number;
  EXPECT_EQ(count, 11u);
  EXPECT_EQ(slam.frames(), 1u);
}

TEST_F(Street, MasksOfWrongTypeAreRejectedWithTheirReason) {
  Slam slam(*camera_preset("simulated"));
  EXPECT_EQ(slam.process((*frames_)[0], cv::Mat(240, 320, CV_8UC1, cv::Scalar(0))).rejected,
            RejectReason::kMask);
  EXPECT_EQ(slam.process((*frames_)[0], cv::Mat(480, 640, CV_8UC3, cv::Scalar(0))).rejected,
            RejectReason::kMask);
  EXPECT_EQ(slam.rejected().at(RejectReason::kMask), 2u);
  // A rejected frame takes no part: the same frame can be given again, with a good mask.
  const auto masked = slam.process((*frames_)[0], cv::Mat(480, 640, CV_8UC1, cv::Scalar(255)));
  EXPECT_TRUE(masked.is_used());
  EXPECT_EQ(masked.state, TrackingState::kInitialising);
}

// Gives frames and then fails, as a camera that is unplugged.
class FailingSource : public FrameSource {
 public:
  explicit FailingSource(const std::vector<Frame>& frames) : frames_(frames) {}
  std::optional<Frame> next() override {
    if (next_ == 10) throw InputError("the camera is gone");
    return frames_[next_++];
  }
  const Camera& camera() const override { return camera_; }

 private:
  const std::vector<Frame>& frames_;
  std::size_t next_ = 0;
  Camera camera_ = *camera_preset("simulated");
};

TEST_F(Street, WhatASourceThrowsIsKeptAndSoAreTheResults) {
  for (const Mode mode : {Mode::kDeterministic, Mode::kRealTime}) {
    FailingSource source(*frames_);
    Slam slam(source.camera(), {}, mode);
    const RunSummary summary = run_slam(source, slam);
    ASSERT_TRUE(summary.failure);
    EXPECT_THROW(std::rethrow_exception(summary.failure), InputError);
    EXPECT_EQ(slam.frames() + summary.dropped, 10u);
    EXPECT_EQ(slam.trajectory().size(), slam.frames());
    EXPECT_GT(slam.frames(), 0u);
  }
}

}  // namespace
}  // namespace roslam::street
