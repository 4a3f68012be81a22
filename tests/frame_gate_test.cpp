// SPDX-License-Identifier: BSD-3-Clause
// Which frames are used, and what a bad time costs: that frame, and never those after it.
#include "roslam/slam/frame_gate.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "roslam/slam/slam.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kFarFuture = 4e9;  // seconds

class FrameTimes : public testing::Test {
 protected:
  static Camera camera() {
    Camera camera;
    camera.width = 64;
    camera.height = 48;
    return camera;
  }

  static Frame at(double timestamp) {
    Frame frame;
    frame.timestamp = timestamp;
    frame.colour = cv::Mat::zeros(48, 64, CV_8UC3);
    frame.depth = cv::Mat::zeros(48, 64, CV_32FC1);
    return frame;
  }

  // The frame is good but for what was changed, and accepted once it is changed back.
  template <typename Spoil>
  void expect_rejected(RejectReason reason, const Spoil& spoil) {
    Frame frame = at(time_);
    cv::Mat mask = cv::Mat::zeros(48, 64, CV_8UC1);
    const Frame good = frame;
    const cv::Mat good_mask = mask;
    spoil(frame, mask);
    EXPECT_EQ(gate_.check(frame, mask).reason, reason) << describe(reason);
    const auto verdict = gate_.check(good, good_mask);
    EXPECT_EQ(verdict.reason, RejectReason::kNone) << describe(reason);
    EXPECT_FALSE(verdict.is_clock_reset) << describe(reason);
    time_ += 0.1;
  }

  void expect_used(double timestamp) {
    const auto verdict = gate_.check(at(timestamp), {});
    EXPECT_EQ(verdict.reason, RejectReason::kNone) << timestamp;
    EXPECT_FALSE(verdict.is_clock_reset) << timestamp;
  }

  void expect_reset(double timestamp) {
    const auto verdict = gate_.check(at(timestamp), {});
    EXPECT_EQ(verdict.reason, RejectReason::kNone) << timestamp;
    EXPECT_TRUE(verdict.is_clock_reset) << timestamp;
  }

  void expect_rejected_time(double timestamp, RejectReason reason = RejectReason::kTimeNotIncreasing) {
    const auto verdict = gate_.check(at(timestamp), {});
    EXPECT_EQ(verdict.reason, reason) << timestamp;
    EXPECT_FALSE(verdict.is_clock_reset) << timestamp;
  }

  FrameGate gate_{camera()};
  double time_ = 100.0;
};

TEST_F(FrameTimes, AnotherSegmentOfTheSourceIsAResetOfTheClock) {
  for (const double timestamp : {10.0, 9.9, 50.0}) {
    Frame frame = at(timestamp);
    frame.segment = timestamp == 10.0 ? 0 : timestamp == 9.9 ? 1 : 2;
    const auto verdict = gate_.check(frame, {});
    EXPECT_EQ(verdict.reason, RejectReason::kNone) << timestamp;
    EXPECT_EQ(verdict.is_clock_reset, timestamp != 10.0) << timestamp;
  }
}

TEST_F(FrameTimes, RejectsImagesOfWrongTypeOrSizeWithTheirReason) {
  using enum RejectReason;
  expect_rejected(kNoColour, [](Frame& f, cv::Mat&) { f.colour.release(); });
  expect_rejected(kColourType, [](Frame& f, cv::Mat&) { f.colour = cv::Mat::zeros(48, 64, CV_8UC1); });
  expect_rejected(kColourType, [](Frame& f, cv::Mat&) { f.colour = cv::Mat::zeros(48, 64, CV_8UC4); });
  expect_rejected(kColourType, [](Frame& f, cv::Mat&) { f.colour = cv::Mat::zeros(48, 64, CV_32FC3); });
  expect_rejected(kColourSize, [](Frame& f, cv::Mat&) { f.colour = cv::Mat::zeros(64, 48, CV_8UC3); });
  expect_rejected(kColourSize, [](Frame& f, cv::Mat&) { f.colour = cv::Mat::zeros(48, 65, CV_8UC3); });
  expect_rejected(kDepthType, [](Frame& f, cv::Mat&) { f.depth = cv::Mat::zeros(48, 64, CV_16UC1); });
  expect_rejected(kDepthType, [](Frame& f, cv::Mat&) { f.depth = cv::Mat::zeros(48, 64, CV_64FC1); });
  expect_rejected(kDepthType, [](Frame& f, cv::Mat&) { f.depth = cv::Mat::zeros(48, 64, CV_32FC3); });
  expect_rejected(kDepthSize, [](Frame& f, cv::Mat&) { f.depth = cv::Mat::zeros(24, 32, CV_32FC1); });
  expect_rejected(kMask, [](Frame&, cv::Mat& mask) { mask = cv::Mat::zeros(48, 64, CV_8UC3); });
  expect_rejected(kMask, [](Frame&, cv::Mat& mask) { mask = cv::Mat::zeros(24, 32, CV_8UC1); });
  expect_rejected(kTimeNotFinite, [](Frame& f, cv::Mat&) { f.timestamp = kNaN; });
}

TEST_F(FrameTimes, DepthAndMaskMayBeMissing) {
  Frame frame = at(1.0);
  frame.depth.release();
  EXPECT_EQ(gate_.check(frame, {}).reason, RejectReason::kNone);
}

TEST_F(FrameTimes, AFrameWithABadImageDoesNotCountAsTheLastOne) {
  expect_used(1.0);
  Frame bad = at(50.0);
  bad.colour.release();
  EXPECT_EQ(gate_.check(bad, {}).reason, RejectReason::kNoColour);
  expect_used(2.0);
}

TEST_F(FrameTimes, NeverTakesATimeThatIsNotFinite) {
  for (const double first : {kNaN, kInfinity, -kInfinity})
    expect_rejected_time(first, RejectReason::kTimeNotFinite);
  expect_used(0.0);
  for (int i = 0; i < 30; ++i) {
    for (const double time : {kNaN, kInfinity, -kInfinity})
      expect_rejected_time(time, RejectReason::kTimeNotFinite);
  }
  expect_used(0.1);
  // They are not frames whose time does not increase, of which ten are a reset.
  for (int i = 0; i < 8; ++i) expect_rejected_time(0.1);
  for (int i = 0; i < 5; ++i) expect_rejected_time(kNaN, RejectReason::kTimeNotFinite);
  expect_rejected_time(0.1);
  expect_reset(0.1);
}

TEST_F(FrameTimes, AFrameFromTheFarFutureCostsOnlyItself) {
  for (int i = 0; i < 10; ++i) expect_used(100.0 + 0.1 * i);
  expect_used(kFarFuture);
  expect_reset(101.0);
  for (int i = 1; i < 10; ++i) expect_used(101.0 + 0.1 * i);
}

TEST_F(FrameTimes, AClockThatRestartsIsFollowedAtOnce) {
  expect_used(1000.0);
  expect_used(1000.1);
  expect_reset(0.0);
  expect_used(0.1);
  expect_rejected_time(0.05);  // times have to increase again
  expect_used(0.2);
}

TEST_F(FrameTimes, AStepBackOfMoreThanASecondIsAResetAndASmallerOneIsNot) {
  expect_used(10.0);
  expect_rejected_time(9.5);
  expect_rejected_time(9.0);  // one second
  expect_reset(8.96875);
}

TEST_F(FrameTimes, ASmallStepBackIsRejectedNineTimesAndAcceptedTheTenth) {
  expect_used(10.0);
  for (int i = 0; i < 9; ++i) expect_rejected_time(9.25 + 0.03125 * i);
  expect_reset(9.75);
  expect_used(9.8);  // earlier than the frame before the reset
}

TEST_F(FrameTimes, OnlyTenInARowAreAReset) {
  for (int round = 0; round < 5; ++round) {
    expect_used(10.0 + round);
    for (int i = 0; i < 9; ++i) expect_rejected_time(9.5 + round);
  }
  expect_used(20.0);
}

TEST_F(FrameTimes, ARepeatedTimeIsRejectedNineTimesAndAcceptedTheTenth) {
  expect_used(5.0);
  for (int i = 0; i < 9; ++i) expect_rejected_time(5.0);
  expect_reset(5.0);
  for (int i = 0; i < 9; ++i) expect_rejected_time(5.0);
  expect_used(5.1);
}

TEST_F(FrameTimes, TimesMayBeNegative) {
  expect_used(-5.0);
  expect_used(-4.5);
  expect_rejected_time(-4.75);
  expect_used(0.0);
}

TEST(RejectReason, EachIsDescribedInItsOwnWords) {
  using enum RejectReason;
  const std::vector<RejectReason> reasons{
      kNone,      kNoColour, kColourType,    kColourSize,        kDepthType,
      kDepthSize, kMask,     kTimeNotFinite, kTimeNotIncreasing, kNoMapToLocaliseIn};
  std::set<std::string> texts;
  for (const RejectReason reason : reasons) {
    const std::string text(describe(reason));
    EXPECT_FALSE(text.empty());
    EXPECT_NE(text, describe(static_cast<RejectReason>(1000)));  // the words for none of them
    EXPECT_TRUE(texts.insert(text).second) << text;
  }
}

// Frames of a simulated flight, as often as a test needs them and with the times it chooses.
class FlightWithBadTimes : public testing::Test {
 protected:
  static constexpr std::size_t kFrames = 20;
  static constexpr std::size_t kRestart = 10;

  static void SetUpTestSuite() {
    simulation::SimulatorOptions options;
    options.traffic = simulation::TrafficLevel::kNone;
    options.frames = kFrames;
    simulation::Simulator simulator(options);
    camera_ = simulator.camera();
    for (std::size_t i = 0; i < kFrames; ++i) frames_.push_back(simulator.render(i).frame);
  }
  static void TearDownTestSuite() { frames_.clear(); }

  static double time_of(std::size_t frame) { return static_cast<double>(frame) / 30.0; }

  static FrameResult give(Slam& slam, std::size_t index, double timestamp) {
    Frame frame = frames_[index];
    frame.timestamp = timestamp;
    return slam.process(frame);
  }

  // Position error of a pose in the world of the first frame's estimate, metres.
  static double error(std::size_t index, const SE3& T_world_camera, const SE3& first) {
    const SE3 truth = first * frames_.front().T_world_camera->inverse() * *frames_[index].T_world_camera;
    return (truth.inverse() * T_world_camera).translation().norm();
  }

  inline static Camera camera_;
  inline static std::vector<Frame> frames_;
};

TEST_F(FlightWithBadTimes, TrackingContinuesWhenTheClockRestarts) {
  for (const bool restarts : {false, true}) {
    Slam slam(camera_);
    std::optional<SE3> first;
    for (std::size_t i = 0; i < kFrames; ++i) {
      const bool is_after = restarts && i >= kRestart;
      const auto result = give(slam, i, is_after ? time_of(i - kRestart) : 1000.0 + time_of(i));
      ASSERT_EQ(result.rejected, RejectReason::kNone) << i;
      ASSERT_EQ(result.state, TrackingState::kTracking) << i;
      ASSERT_TRUE(result.T_world_camera) << i;
      if (!first) first = result.T_world_camera;
      EXPECT_LT(error(i, *result.T_world_camera, *first), 0.05) << i;
      EXPECT_EQ(result.is_clock_reset, restarts && i == kRestart) << i;
    }
    slam.finish();
    EXPECT_EQ(slam.clock_resets(), restarts ? 1U : 0U);
    EXPECT_TRUE(slam.rejected().empty());
    EXPECT_EQ(slam.trajectory().size(), kFrames);
    EXPECT_EQ(slam.map().submaps().size(), 1U);
  }
}

// At times of the old clock no keyframe would be due until the new one has reached them.
TEST_F(FlightWithBadTimes, KeyframesAreMadeAsBeforeWhenTheClockRestarts) {
  Options options;
  options.keyframes.min_interval = 0.0;
  options.keyframes.min_overlap = 0.95;
  std::array<std::size_t, 2> made{};  // keyframes after the restart
  for (const bool restarts : {false, true}) {
    Slam slam(camera_, options);
    for (std::size_t i = 0; i < kFrames; ++i) {
      const bool is_after = restarts && i >= kRestart;
      const auto result = give(slam, i, is_after ? time_of(i - kRestart) : 1000.0 + time_of(i));
      if (i > kRestart && result.is_keyframe) ++made[restarts ? 1 : 0];
    }
  }
  EXPECT_GE(made[0], 2U);
  EXPECT_GE(2 * made[1], made[0]);
}

TEST_F(FlightWithBadTimes, AFrameFromTheFarFutureCostsAtMostThatFrame) {
  Slam slam(camera_);
  std::optional<SE3> first;
  for (std::size_t i = 0; i < kFrames; ++i) {
    const auto result = give(slam, i, i == kRestart ? kFarFuture : 1000.0 + time_of(i));
    ASSERT_EQ(result.rejected, RejectReason::kNone) << i;
    EXPECT_EQ(result.is_clock_reset, i == kRestart + 1) << i;
    if (!first) first = result.T_world_camera;
    if (result.T_world_camera) {
      EXPECT_LT(error(i, *result.T_world_camera, *first), 0.05) << i;
    }
    if (i != kRestart) {
      EXPECT_EQ(result.state, TrackingState::kTracking) << i;
    }
  }
  slam.finish();
  EXPECT_EQ(slam.clock_resets(), 1U);
  EXPECT_TRUE(slam.rejected().empty());
  EXPECT_GE(slam.trajectory().size(), kFrames - 1);
  EXPECT_EQ(slam.map().submaps().size(), 1U);
}

TEST_F(FlightWithBadTimes, ARejectedFrameGivesItsReasonAndTheStateOfTheTracker) {
  struct Case {
    RejectReason reason;
    void (*spoil)(Frame& frame, cv::Mat& mask);
  };
  using enum RejectReason;
  const std::vector<Case> cases{
      {kNoColour, [](Frame& f, cv::Mat&) { f.colour.release(); }},
      {kColourType, [](Frame& f, cv::Mat&) { f.colour = cv::Mat::zeros(480, 640, CV_8UC1); }},
      {kColourSize, [](Frame& f, cv::Mat&) { f.colour = cv::Mat::zeros(240, 320, CV_8UC3); }},
      {kDepthType, [](Frame& f, cv::Mat&) { f.depth = cv::Mat::zeros(480, 640, CV_16UC1); }},
      {kDepthSize, [](Frame& f, cv::Mat&) { f.depth = cv::Mat::zeros(240, 320, CV_32FC1); }},
      {kMask, [](Frame&, cv::Mat& mask) { mask = cv::Mat::zeros(240, 320, CV_8UC1); }},
      {kTimeNotFinite, [](Frame& f, cv::Mat&) { f.timestamp = kNaN; }},
      {kTimeNotIncreasing, [](Frame& f, cv::Mat&) { f.timestamp -= 0.5; }},
  };
  Slam slam(camera_);
  const auto expect_rejected = [&](std::size_t index, const Case& tested, TrackingState state) {
    Frame frame = frames_[index];
    frame.timestamp = 1000.0 + time_of(index);
    cv::Mat mask;
    tested.spoil(frame, mask);
    FrameResult result;
    ASSERT_NO_THROW(result = slam.process(frame, mask));
    EXPECT_EQ(result.rejected, tested.reason);
    EXPECT_FALSE(result.is_used());
    EXPECT_EQ(result.index, index);
    EXPECT_EQ(result.state, state) << describe(tested.reason);
    EXPECT_FALSE(result.T_world_camera);
    EXPECT_FALSE(result.is_keyframe);
    EXPECT_FALSE(result.is_clock_reset);
    EXPECT_TRUE(result.points.empty());
  };
  for (const auto& tested : cases) {
    if (tested.reason != kTimeNotIncreasing) expect_rejected(0, tested, TrackingState::kInitialising);
  }
  for (std::size_t i = 0; i < 5; ++i) {
    ASSERT_EQ(give(slam, i, 1000.0 + time_of(i)).state, TrackingState::kTracking);
    for (const auto& tested : cases) expect_rejected(i, tested, TrackingState::kTracking);
  }
  for (const auto& tested : cases)
    EXPECT_EQ(slam.rejected().at(tested.reason), tested.reason == kTimeNotIncreasing ? 5U : 6U);
  EXPECT_EQ(slam.rejected().size(), cases.size());
  EXPECT_EQ(slam.frames(), 5U);
  EXPECT_EQ(slam.frames_by_state().at(TrackingState::kTracking), 5U);
  EXPECT_EQ(slam.clock_resets(), 0U);
}

TEST_F(FlightWithBadTimes, WithoutKeyframesAFrameNeedsAMap) {
  for (const bool makes_keyframes : {false, true}) {
    Options options;
    options.keyframes.enabled = makes_keyframes;
    Slam slam(camera_, options);
    const auto result = give(slam, 0, 1000.0);
    EXPECT_EQ(result.rejected, makes_keyframes ? RejectReason::kNone : RejectReason::kNoMapToLocaliseIn);
    EXPECT_EQ(result.state, makes_keyframes ? TrackingState::kTracking : TrackingState::kInitialising);
    EXPECT_EQ(slam.rejected().size(), makes_keyframes ? 0U : 1U);
  }
}

}  // namespace
}  // namespace roslam
