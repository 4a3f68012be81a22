// SPDX-License-Identifier: BSD-3-Clause
// A moving object fills the image for a while: poses are predicted, with tracking quality 0, and tracking
// resumes in the same map when the view clears.
#include <gtest/gtest.h>

#include <memory>
#include <opencv2/imgproc.hpp>

#include "recording/removal_log.hpp"
#include "recording/run_folder.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/mapping/local_mapper.hpp"
#include "roslam/semantics/segmenter.hpp"
#include "roslam/slam/run.hpp"
#include "roslam/options/settings.hpp"
#include "roslam/tracking/tracker.hpp"
#include "tests/street_frames.hpp"

namespace roslam::street {

using namespace recording;
namespace {

constexpr std::uint8_t kPersonLabel = 11;
constexpr std::size_t kHidden = 25;  // the first frame that shows no street
const cv::Scalar kCoat(90, 90, 90);

// An object close to the camera: a share of the image, from the left.
cv::Rect coat(double share) { return {0, 0, static_cast<int>(640 * share), 480}; }

// Labels the coat by its colour.
class CoatIsPerson : public Segmenter {
 public:
  Segmentation segment(const cv::Mat& image) override {
    Segmentation result;
    cv::Mat is_coat;
    cv::inRange(image, kCoat, kCoat, is_coat);
    result.labels = cv::Mat::zeros(image.size(), CV_8UC1);
    // Single pixels of the street may have that colour.
    if (2 * cv::countNonZero(is_coat) > static_cast<int>(image.total())) {
      result.labels.setTo(kPersonLabel, is_coat);
    }
    result.confidence.fill(0.9F);
    return result;
  }
};

class HiddenView : public Street {
 protected:
  // A coat over a share of the image, fog over the rest.
  static Frame hidden(std::size_t index, double share) {
    Frame frame = blank(index, cv::Scalar::all(200));
    frame.colour(coat(share)).setTo(kCoat);
    frame.depth(coat(share)).setTo(0.8F);
    return frame;
  }

  static std::vector<Frame> sequence(std::size_t hidden_end, std::size_t end, double share = 0.75) {
    std::vector<Frame> all = with_blank(kHidden, hidden_end, end, cv::Scalar::all(200));
    for (auto& frame : all) {
      if (frame.index >= kHidden && frame.index < hidden_end) frame = hidden(frame.index, share);
    }
    return all;
  }

  static std::unique_ptr<Slam> slam_with(const Options& options = {}) {
    return std::make_unique<Slam>(*camera_preset("simulated"), options, Mode::kDeterministic,
                                  std::make_shared<CoatIsPerson>());
  }

  void expect_near_truth(const Frame& frame, const FrameResult& result, double metres) {
    ASSERT_TRUE(result.T_world_camera) << frame.index;
    if (!first_) first_ = result.T_world_camera;
    const SE3 error = truth(frame, *first_).inverse() * *result.T_world_camera;
    EXPECT_LT(error.translation().norm(), metres) << frame.index;
    EXPECT_LT(error.angle(), 0.02) << frame.index;
  }

  std::optional<SE3> first_;  // estimated pose of the first frame
};

TEST_F(HiddenView, IsBridgedByPredictionsAndTrackingTakesUpAgain) {
  constexpr std::size_t kEndHidden = kHidden + 10;
  const auto slam = slam_with();
  std::size_t keyframes = 0;
  for (const Frame& frame : sequence(kEndHidden, kBeforeGap)) {
    const auto result = slam->process(frame);
    ASSERT_TRUE(result.is_used());
    const Frame& street = frames_->at(frame.index);  // as it would have been
    if (frame.index < kHidden) {
      ASSERT_EQ(result.state, TrackingState::kTracking) << frame.index;
      EXPECT_EQ(result.quality, 1.0);
      expect_near_truth(street, result, 0.05);
      keyframes = slam->map().keyframe_count();
    } else if (frame.index < kEndHidden) {
      EXPECT_EQ(result.state, TrackingState::kPredicted) << frame.index;
      EXPECT_EQ(result.quality, 0.0);
      EXPECT_EQ(result.inliers, 0);
      EXPECT_FALSE(result.is_keyframe);
      EXPECT_EQ(slam->map().keyframe_count(), keyframes);
      // A third of a second at a metre a second.
      expect_near_truth(street, result, 0.15);
    } else {
      EXPECT_EQ(result.state, TrackingState::kTracking) << frame.index;
      EXPECT_GT(result.inliers, 60);
      EXPECT_EQ(result.quality, 1.0);
      expect_near_truth(street, result, 0.05);
    }
  }
  slam->finish();
  EXPECT_EQ(slam->trajectory().size(), kBeforeGap);
  EXPECT_EQ(slam->frames_by_state().at(TrackingState::kPredicted), kEndHidden - kHidden);
  EXPECT_FALSE(slam->frames_by_state().contains(TrackingState::kRecentlyLost));
}

TEST_F(HiddenView, IsLostWhereItLastsTooLongAndFoundAgain) {
  Options options;
  options.tracker.max_predicted = 0.51;
  constexpr std::size_t kGivenUp = kHidden + 15;  // more than that after the last frame that was tracked
  const auto slam = slam_with(options);
  std::size_t recovered = 0;
  for (const Frame& frame : sequence(kGapEnd, kEnd)) {
    const auto result = slam->process(frame);
    ASSERT_TRUE(result.is_used());
    if (frame.index < kHidden) {
      expect_near_truth(frame, result, 0.05);
    } else if (frame.index < kGapEnd) {
      const bool is_given_up = frame.index >= kGivenUp;
      EXPECT_EQ(result.T_world_camera.has_value(), !is_given_up) << frame.index;
      EXPECT_EQ(result.state, !is_given_up                  ? TrackingState::kPredicted
                              : frame.index < kGivenUp + 30 ? TrackingState::kRecentlyLost
                                                            : TrackingState::kLost)
          << frame.index;
      EXPECT_EQ(result.quality, 0.0);
    } else if (result.T_world_camera) {
      ++recovered;
      EXPECT_EQ(result.state, TrackingState::kTracking);
      expect_near_truth(frame, result, 0.1);
    }
  }
  EXPECT_GE(recovered, kEnd - kGapEnd - 1);
  slam->finish();
  EXPECT_EQ(slam->trajectory().size(), kGivenUp + recovered);
}

TEST_F(HiddenView, IsNotPredictedWhereNothingMoves) {
  const auto slam = slam_with();
  for (const Frame& frame : with_blank(kHidden, kHidden + 3, kHidden + 3, cv::Scalar::all(200))) {
    const auto result = slam->process(frame);
    ASSERT_TRUE(result.is_used());
    EXPECT_EQ(result.state, frame.index < kHidden ? TrackingState::kTracking : TrackingState::kRecentlyLost);
  }
}

TEST_F(HiddenView, IsNotPredictedWhereItIsNotWanted) {
  Options options;
  options.tracker.hidden_share = 0.9;  // more than the coat hides
  const auto slam = slam_with(options);
  for (const Frame& frame : sequence(kHidden + 3, kHidden + 3)) {
    const auto result = slam->process(frame);
    ASSERT_TRUE(result.is_used());
    EXPECT_EQ(result.state, frame.index < kHidden ? TrackingState::kTracking : TrackingState::kRecentlyLost);
  }
}

// Views of the street given straight to a tracker, with a keyframe wherever the test wants one.
class HiddenTracker : public Street {
 protected:
  std::shared_ptr<const ObservedFrame> view(std::size_t index, const cv::Rect& part, std::size_t most) const {
    const Frame& frame = frames_->at(index);
    cv::Mat grey;
    cv::cvtColor(frame.colour, grey, cv::COLOR_BGR2GRAY);
    cv::Mat mask(grey.size(), CV_8UC1, cv::Scalar(255));
    mask(part).setTo(0);
    auto features = extractor_.extract(grey, mask);
    if (features.size() > most) features.resize(most);
    return std::make_shared<ObservedFrame>(observe(features, frame.colour, frame.depth, camera_, {}));
  }

  static Tracker::Settings settings() {
    Tracker::Settings settings = tracker_settings(Options());
    settings.tracker.min_inliers = 60;
    settings.relocaliser.min_inliers = 8;  // recognised, but not confirmed
    return settings;
  }

  static std::vector<float> scales(const OrbExtractor& extractor) {
    std::vector<float> scales;
    for (int level = 0; level < extractor.levels(); ++level) scales.push_back(extractor.scale(level));
    return scales;
  }

  const Camera camera_ = *camera_preset("simulated");
  const OrbExtractor extractor_;
  Map map_{scales(extractor_)};
  MapMutex mutex_;
  LocalMapper mapper_{camera_, map_, mutex_, mapper_settings(Options())};
  Tracker tracker_{camera_, map_, settings()};
};

TEST_F(HiddenTracker, PredictionsSurviveAPlaceThatIsRecognisedButNotConfirmed) {
  const cv::Rect all(0, 0, 640, 480);
  constexpr std::size_t kLast = 40;
  std::optional<SE3> first;
  for (std::size_t i = 0; i <= kLast; ++i) {
    const auto tracked = tracker_.track(view(i, all, 2000), time_of(i));
    ASSERT_EQ(tracked.state, TrackingState::kTracking) << i;
    if (!first) first = tracked.T_camera_world->inverse();
    if (i != 0 && i != kLast) continue;
    const KeyframeId keyframe = mapper_.insert(tracked, i);
    tracker_.keyframe_created(keyframe);
  }
  // The visible remainder matches the first keyframe, more than a metre back, but has too few points to
  // relocalise.
  const auto scrap = view(0, {0, 430, 640, 50}, 50);
  const Tracker::Settings given = settings();
  GeometricVerifier check(camera_, {given.geometric_verifier, given.matcher, given.pose, given.noise});
  const auto match = Relocaliser(given.relocaliser, check).find(map_, *scrap, {}, false);
  ASSERT_TRUE(match);
  ASSERT_EQ(match->matched_keyframe, map_.keyframe_ids().front());
  for (std::size_t i = kLast + 1; i < kLast + 4; ++i) {
    const auto tracked = tracker_.track(scrap, time_of(i), {{}, 0.8});
    ASSERT_EQ(tracked.state, TrackingState::kPredicted) << i;
    const SE3 error = truth(frames_->at(i), *first).inverse() * tracked.T_camera_world->inverse();
    EXPECT_LT(error.translation().norm(), 0.1) << i;
  }
}

class Frames : public FrameSource {
 public:
  explicit Frames(std::vector<Frame> frames) : frames_(std::move(frames)) {}
  std::optional<Frame> next() override {
    if (next_ == frames_.size()) return std::nullopt;
    return frames_[next_++];
  }
  const Camera& camera() const override { return camera_; }

 private:
  std::vector<Frame> frames_;
  std::size_t next_ = 0;
  Camera camera_ = *camera_preset("simulated");
};

TEST_F(HiddenView, IsReported) {
  const fs::path folder = scratch_path();
  fs::create_directories(folder);
  Frames source(sequence(kHidden + 10, kHidden + 20));
  const auto slam = slam_with();
  RemovalLog log({folder, Mode::kDeterministic, 30.0, false});
  RunResults summary;
  static_cast<RunSummary&>(summary) =
      run_slam(source, *slam, [&](const Frame& frame, const FrameResult& result) { log.add(frame, result); });
  ASSERT_FALSE(summary.failure);
  log.finish();
  summary.removal = log.tally();
  const auto report = nlohmann::json::parse(run_report(*slam, summary, source, {}));
  EXPECT_EQ(report["dynamic"]["predicted_frames"], 10);
  EXPECT_EQ(report["dynamic"]["low_quality_frames"], 10);
  EXPECT_EQ(report["frames"]["by_state"]["predicted"], 10);
  EXPECT_EQ(report["frames"]["tracked"], kHidden + 10);
  EXPECT_EQ(report["frames"]["processed"], kHidden + 20);
  std::istringstream lines(content(folder / "descriptors.jsonl"));
  std::size_t index = 0;
  for (std::string text; std::getline(lines, text); ++index) {
    const auto line = nlohmann::json::parse(text);
    const bool is_hidden = index >= kHidden && index < kHidden + 10;
    EXPECT_EQ(line["state"], is_hidden ? "predicted" : "tracking") << index;
    EXPECT_EQ(line["quality"], is_hidden ? 0.0 : 1.0) << index;
    if (is_hidden) {
      EXPECT_GT(line["removed_area"], 0.7);
    }
  }
  EXPECT_EQ(index, kHidden + 20);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace roslam::street
