// SPDX-License-Identifier: BSD-3-Clause
// Tracking, mapping and the dense map of stereo pairs: simulated, and recorded ones where they are at hand.
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "evaluation/trajectory_error.hpp"
#include "roslam/common/error.hpp"
#include "roslam/datasets/dataset.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/slam/run.hpp"
#include "roslam/slam/slam.hpp"
#include "roslam/stereo/rectified_source.hpp"
#include "simulation/simulated_source.hpp"
#include "simulation/wrapped_source.hpp"

namespace roslam {
namespace {

namespace fs = std::filesystem;
using namespace evaluation;
using namespace simulation;

SimulatorOptions street(std::size_t frames) {
  SimulatorOptions options;
  options.stereo = true;
  options.traffic = TrafficLevel::kNone;
  options.frames = frames;
  return options;
}

Options static_options(bool dense) {
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  options.dense.enabled = dense;
  return options;
}

struct Flown {
  TrajectoryError error;
  Trajectory trajectory;
  std::size_t frames = 0, tracked = 0;
};

// The frames of one flight, rendered once.
class Street : public FrameSource {
 public:
  explicit Street(std::size_t frames) : size_(frames) {}
  std::optional<Frame> next() override {
    return at_ < size_ ? std::optional(rendered().at(at_++)) : std::nullopt;
  }
  using FrameSource::next;
  const Camera& camera() const override { return camera_; }

 private:
  static const std::vector<Frame>& rendered() {
    static const std::vector<Frame> frames = [] {
      SimulatedSource source(street(75));
      std::vector<Frame> all;
      while (auto frame = source.next()) all.push_back(std::move(*frame));
      return all;
    }();
    return frames;
  }

  std::size_t size_, at_ = 0;
  Camera camera_ = SimulatedSource(street(1)).camera();
};

Flown fly(FrameSource& source, Slam& slam) {
  const RunSummary summary = run_slam(source, slam);
  EXPECT_FALSE(summary.failure);
  Flown flown{evaluate_trajectory(summary.truth, slam.trajectory()), slam.trajectory(), slam.frames(), 0};
  flown.tracked = flown.trajectory.size();
  return flown;
}

Flown fly(FrameSource& source) {
  Slam slam(source.camera(), static_options(false));
  return fly(source, slam);
}

// Changes the frames of a source.
class ChangedSource : public WrappedSource {
 public:
  ChangedSource(FrameSource& source, std::function<void(Frame&)> change)
      : WrappedSource(source), change_(std::move(change)) {}
  std::optional<Frame> next() override {
    auto frame = source().next();
    if (frame) change_(*frame);
    return frame;
  }
  using FrameSource::next;

 private:
  std::function<void(Frame&)> change_;
};

TEST(StereoSlam, FollowsTheStreet) {
  Street source(75);
  const Flown flown = fly(source);
  EXPECT_EQ(flown.tracked, 75U);
  EXPECT_LT(flown.error.ate.rmse, 0.01);
}

TEST(StereoSlam, RepeatsItself) {
  Street first(40), second(40);
  const Trajectory a = fly(first).trajectory, b = fly(second).trajectory;
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_TRUE(a[i].T_world_camera == b[i].T_world_camera) << i;
}

TEST(StereoSlam, GoesOnWhereRightImagesAreMissing) {
  Street source(75);
  ChangedSource lossy(source, [](Frame& frame) {
    if (frame.index % 3 == 1 || (frame.index >= 40 && frame.index < 55)) frame.right.release();
  });
  const Flown flown = fly(lossy);
  EXPECT_EQ(flown.tracked, 75U);
  EXPECT_LT(flown.error.ate.rmse, 0.015);
}

TEST(StereoSlam, RefusesARightImageOfAnotherKind) {
  Street source(2);
  Slam slam(source.camera(), static_options(false));
  Frame frame = *source.next();
  frame.right = cv::Mat(frame.right.size(), CV_8UC3);
  EXPECT_EQ(slam.process(frame).rejected, RejectReason::kRightImage);
  frame.right = cv::Mat(10, 10, CV_8UC1);
  EXPECT_EQ(slam.process(frame).rejected, RejectReason::kRightImage);
}

TEST(StereoSlam, MapsAreSavedWithTheirUncertainties) {
  Street source(30);
  Slam slam(source.camera(), static_options(false));
  fly(source, slam);
  const SavedMap saved = slam.saved_map();
  const SavedMap read = decode_map(encode_map(saved), "map");
  EXPECT_EQ(read.camera.baseline, source.camera().baseline);
  const auto before = saved.map.keyframe_ids(), after = read.map.keyframe_ids();
  ASSERT_EQ(before.size(), after.size());
  std::size_t known = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const auto &a = saved.map.find(before[i])->view->inverse_depth_sigmas,
               &b = read.map.find(after[i])->view->inverse_depth_sigmas;
    EXPECT_EQ(a, b);
    known += static_cast<std::size_t>(std::count_if(a.begin(), a.end(), [](float s) { return s > 0.0F; }));
  }
  EXPECT_GT(known, 100U);
}

// Dense depth comes of every frame where geometry needs it, else of keyframes only.
TEST(StereoSlam, MakesADenseMapEitherWay) {
  for (const bool every_frame : {true, false}) {
    Street source(30);
    Options options = static_options(true);
    options.dynamic_objects = *options_of_mode("geometry", options.dynamic_objects);
    options.stereo.every_frame = every_frame;
    Slam slam(source.camera(), options);
    slam.enable_dense_mapping();
    const Flown flown = fly(source, slam);
    EXPECT_EQ(flown.tracked, 30U);
    const auto map = slam.dense_map();
    ASSERT_TRUE(map);
    EXPECT_GT(map->surface.points.size(), 10000U);
    const auto stages = slam.times().summary();
    EXPECT_EQ(stages.contains("tracking.dense_stereo"), every_frame);
    EXPECT_EQ(stages.contains("stereo.dense"), !every_frame);
  }
}

// Gives frames that are made up.
class ListedPairs : public FrameSource {
 public:
  explicit ListedPairs(std::vector<Frame> frames) : frames_(std::move(frames)) { camera_.baseline = 0.1; }
  std::optional<Frame> next() override {
    return at_ < frames_.size() ? std::optional(frames_[at_++]) : std::nullopt;
  }
  using FrameSource::next;
  const Camera& camera() const override { return camera_; }
  std::optional<RightCamera> right() const override { return right_; }
  void set_right(const RightCamera& right) { right_ = right; }

 private:
  Camera camera_;
  std::optional<RightCamera> right_;
  std::vector<Frame> frames_;
  std::size_t at_ = 0;
};

Frame made_up(std::size_t index, int left, int right) {
  Frame frame;
  frame.index = index;
  frame.timestamp = 0.1 * static_cast<double>(index);
  frame.colour = cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(left));
  if (right >= 0) frame.right = cv::Mat(480, 640, CV_8UC1, cv::Scalar(right));
  return frame;
}

TEST(RectifiedSource, LeavesOutRightImagesThatAreOfNoUse) {
  std::vector<Frame> frames{made_up(0, 50, 60), made_up(1, 51, 0),  made_up(2, 52, 61), made_up(3, 53, 61),
                            made_up(4, 54, -1), made_up(5, 54, 62), made_up(6, 55, 63), made_up(7, 56, 64)};
  frames[7].right = cv::Mat(10, 10, CV_8UC1, cv::Scalar(64));
  for (const std::size_t i : {5U, 6U}) frames[i].inertial.push_back(InertialSample{});
  RectifiedSource source(std::make_unique<ListedPairs>(frames));
  std::vector<std::size_t> with_right, without;
  while (const auto frame = source.next()) {
    (frame->right.empty() ? without : with_right).push_back(frame->index);
    EXPECT_EQ(frame->inertial.size(), frame->index == 6 ? 2U : 0U)
        << "those of a frame that is skipped are kept";
  }
  EXPECT_EQ(with_right, (std::vector<std::size_t>{0, 2, 6}));
  EXPECT_EQ(without, (std::vector<std::size_t>{1, 3, 4, 7}));
  const Counts expected{{"right image is black", 1},
                        {"right image is that of the frame before", 1},
                        {"right image of another size than the left one", 1}};
  EXPECT_EQ(source.skipped_depth(), expected);
  EXPECT_EQ(source.skipped(), (Counts{{"left image is that of the frame before", 1}}));
}

TEST(RectifiedSource, RefusesACameraOfRectifiedPairsForOthers) {
  auto pairs = std::make_unique<ListedPairs>(std::vector<Frame>{made_up(0, 50, 60)});
  pairs->set_right({Camera(), SE3(Eigen::Quaterniond::Identity(), {0.1, 0.0, 0.0})});
  EXPECT_EQ(RectifiedSource(std::move(pairs)).camera().baseline, 0.1);
  pairs = std::make_unique<ListedPairs>(std::vector<Frame>{made_up(0, 50, 60)});
  pairs->set_right({Camera(), SE3(so3_exp({0.0, 0.01, 0.0}), {0.1, 0.0, 0.0})});
  EXPECT_THROW(RectifiedSource(std::move(pairs)), CalibrationError);
}

TEST(RectifiedSource, NeedsPairs) {
  SimulatorOptions options = street(2);
  options.stereo = false;
  EXPECT_THROW(RectifiedSource(std::make_unique<SimulatedSource>(options)), InputError);
}

// Recordings: all frames tracked; limits of the error in metres.
class StereoRecording : public testing::TestWithParam<std::tuple<const char*, std::size_t, double>> {};

TEST_P(StereoRecording, IsTrackedThroughout) {
  const auto& [name, frames, limit] = GetParam();
  const fs::path folder = fs::path(ROSLAM_TEST_DATA) / "slam" / name;
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not at hand";
  const auto source = open_dataset(folder, {});
  const Flown flown = fly(*source);
  EXPECT_EQ(flown.frames, frames);
  EXPECT_EQ(flown.tracked, frames);
  EXPECT_LE(flown.error.ate.rmse, limit);
  std::printf("%s: ATE %.4f m\n", name, flown.error.ate.rmse);
}

INSTANTIATE_TEST_SUITE_P(Recordings, StereoRecording,
                         testing::Values(std::make_tuple("euroc_mh01", 170U, 0.0045),
                                         std::make_tuple("kitti06_stereo", 51U, 0.12)));

}  // namespace
}  // namespace roslam
