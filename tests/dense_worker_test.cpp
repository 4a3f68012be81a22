// SPDX-License-Identifier: BSD-3-Clause
// Dense mapping in its own thread: it never blocks the tracker.
#include "roslam/workers/dense_worker.hpp"

#include <gtest/gtest.h>

#include <array>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <mutex>
#include <vector>

#include "roslam/common/error.hpp"
#include "tests/restoration_scene.hpp"

namespace roslam::scene {
namespace {

constexpr float kWallDepth = 3.0F;  // metres, of the whole image
constexpr SubmapId kHere{0};

class Dense : public testing::Test {
 protected:
  void start(Mode mode, DenseOptions dense = {}) {
    dense.voxel_size = 0.05;
    dense.follow_every = 1000;
    Options options;
    options.dense = dense;
    worker_.emplace(stage_.camera(), options, mode, [this](const std::vector<KeyframeId>& ids) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return !is_held_; });
      if (fails_) throw ModelError("where that is nobody knows");
      std::vector<KeyframePose> places;
      for (const KeyframeId id : ids)
        places.push_back({kHere, shift_ * SE3(Eigen::Quaterniond::Identity(), {0.05 * id.value, 0.0, 0.0})});
      return places;
    });
  }

  // A wall with an object in front in the middle of the image.
  DenseInput keyframe(bool with_thing, bool is_restored = false) const {
    const Camera& camera = stage_.camera();
    DenseInput result;
    result.is_restored = is_restored;
    Frame& frame = result.frame;
    frame.colour = cv::Mat(camera.height, camera.width, CV_8UC3, cv::Scalar(50, 100, 150));
    frame.depth = cv::Mat(frame.colour.size(), CV_32FC1, cv::Scalar(kWallDepth));
    if (!with_thing) return result;
    const cv::Rect middle(camera.width / 3, camera.height / 3, camera.width / 3, camera.height / 3);
    cv::Mat mask = cv::Mat::zeros(frame.colour.size(), CV_8UC1);
    mask(middle).setTo(255);
    frame.depth.setTo(1.5F, mask);
    frame.colour.setTo(cv::Scalar(0, 0, 255), mask);
    MovableObject object;
    EXPECT_TRUE(take_mask(object, mask));
    result.dynamic_objects.objects = {object};
    return result;
  }

  DenseMap result() {
    worker_->drain();
    return *worker_->result(kHere);
  }

  // Points close to the optical axis of the first keyframe, where the object is.
  static std::size_t in_the_middle(const SurfaceMap& surface) {
    return static_cast<std::size_t>(
        std::count_if(surface.points.begin(), surface.points.end(),
                      [](const auto& p) { return p.position.template head<2>().norm() < 0.2F; }));
  }

  Stage stage_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_held_ = false, fails_ = false;
  SE3 shift_;  // of all keyframes, as a correction of the map makes it
  std::optional<DenseWorker> worker_;
};

TEST_F(Dense, MapsWhatIsStaticAndKeepsWhatWasRemovedApart) {
  start(Mode::kDeterministic);
  worker_->submit(KeyframeId{0}, keyframe(true));
  const DenseMap map = result();
  EXPECT_EQ(map.keyframes, 1U);
  ASSERT_GT(map.surface.points.size(), 200U);
  for (const SurfacePoint& point : map.surface.points) EXPECT_NEAR(point.position.z(), kWallDepth, 0.02F);
  EXPECT_EQ(in_the_middle(map.surface), 0U);
  ASSERT_GT(map.removed.size(), 20U);
  for (const SurfacePoint& point : map.removed) {
    EXPECT_NEAR(point.position.z(), point.colour == cv::Vec3b(0, 0, 255) ? 1.5F : kWallDepth, 1e-4F);
  }
}

// Points of the changes, placed, and the number of blocks with any.
std::vector<Eigen::Vector3f> placed(const SurfaceChanges& changes) {
  std::vector<Eigen::Vector3f> points;
  for (const auto& block : changes.blocks) {
    for (const auto& point : block->points) {
      Eigen::Vector3f place;
      for (int i = 0; i < 3; ++i)
        place[i] = static_cast<float>(changes.side) *
                   (static_cast<float>(block->index[static_cast<std::size_t>(i)]) +
                    (static_cast<float>(point.position[static_cast<std::size_t>(i)]) + 0.5F) / 256.0F);
      points.push_back(place);
    }
  }
  return points;
}

TEST_F(Dense, TellsWhatChangedInTheSurfacesToWhoAsks) {
  start(Mode::kDeterministic);
  worker_->submit(KeyframeId{0}, keyframe(false));
  EXPECT_TRUE(worker_->surface_changes({}, 0, SIZE_MAX).blocks.empty()) << "from now on";
  worker_->submit(KeyframeId{1}, keyframe(false));
  const SurfaceChanges all = worker_->surface_changes({}, 0, SIZE_MAX);
  EXPECT_EQ(all.submap, kHere);
  EXPECT_TRUE(all.is_all);
  EXPECT_FALSE(all.has_more);
  EXPECT_DOUBLE_EQ(all.side, 8 * 0.05);
  ASSERT_GT(placed(all).size(), 200U);
  for (const Eigen::Vector3f& point : placed(all)) EXPECT_NEAR(point.z(), kWallDepth, 0.02F);
  EXPECT_LT(cv::norm(all.blocks.front()->points.front().colour, cv::Vec3b(50, 100, 150)), 3.0);
  const SurfaceChanges none = worker_->surface_changes(kHere, all.revision, SIZE_MAX);
  EXPECT_TRUE(none.blocks.empty());
  EXPECT_FALSE(none.is_all);
  worker_->submit(KeyframeId{40}, keyframe(false));  // 2 m to the right
  const SurfaceChanges some = worker_->surface_changes(kHere, all.revision, SIZE_MAX);
  EXPECT_FALSE(some.is_all);
  EXPECT_GT(some.blocks.size(), 0U);
  EXPECT_LT(some.blocks.size(), worker_->surface_changes({}, 0, SIZE_MAX).blocks.size());
}

TEST_F(Dense, TellsOfSurfacesInPartsAndOfThoseThatAreGone) {
  start(Mode::kDeterministic);
  worker_->surface_changes({}, 0, SIZE_MAX);
  worker_->submit(KeyframeId{0}, keyframe(false));
  std::map<std::array<std::int32_t, 3>, std::size_t> points;
  SurfaceChanges part;
  do {
    part = worker_->surface_changes(part.submap, part.revision, 100);
    for (const auto& block : part.blocks) points[block->index] = block->points.size();
  } while (part.has_more);
  const SurfaceChanges all = worker_->surface_changes({}, 0, SIZE_MAX);
  EXPECT_EQ(points.size(), all.blocks.size());
  for (const auto& block : all.blocks) EXPECT_EQ(points.at(block->index), block->points.size());
  shift_ = SE3(Eigen::Quaterniond::Identity(), {0.0, 0.0, 4.0});
  worker_->drain();  // follows the keyframe to where it is now
  worker_->submit(KeyframeId{1}, keyframe(false));
  part = worker_->surface_changes(part.submap, part.revision, SIZE_MAX);
  for (const auto& block : part.blocks) points[block->index] = block->points.size();
  for (const auto& block : all.blocks) EXPECT_EQ(points.at(block->index), 0U) << "the wall is elsewhere now";
  for (const Eigen::Vector3f& point : placed(part)) EXPECT_NEAR(point.z(), kWallDepth + 4.0F, 0.02F);
}

TEST_F(Dense, FusesImagesAsTakenIfToldTo) {
  DenseOptions options;
  options.remove = false;
  start(Mode::kDeterministic, options);
  worker_->submit(KeyframeId{0}, keyframe(true));
  const DenseMap map = result();
  EXPECT_GT(in_the_middle(map.surface), 20U);
  EXPECT_TRUE(map.removed.empty());
}

TEST_F(Dense, WaitsForAKeyframeToBeRestored) {
  start(Mode::kDeterministic);
  worker_->submit(KeyframeId{0}, keyframe(true, true));
  EXPECT_EQ(result().keyframes, 0U);
  const DenseInput empty = keyframe(false);
  RestoredImage view{empty.frame.colour,
                     empty.frame.depth,
                     cv::Mat(empty.frame.colour.size(), CV_8UC1, cv::Scalar(255)),
                     {},
                     {}};
  worker_->restored(KeyframeId{0}, &view);
  const DenseMap map = result();
  EXPECT_GT(in_the_middle(map.surface), 20U);
  for (const SurfacePoint& point : map.surface.points) EXPECT_EQ(point.provenance, Provenance::kInpainted);
  EXPECT_GT(map.removed.size(), 20U);
}

TEST_F(Dense, TakesAKeyframeThatCouldNotBeRestoredWithItsHoles) {
  start(Mode::kDeterministic);
  worker_->submit(KeyframeId{0}, keyframe(true, true));
  worker_->restored(KeyframeId{0}, nullptr);
  worker_->restored(KeyframeId{0}, nullptr);  // said twice
  const DenseMap map = result();
  EXPECT_EQ(map.keyframes, 1U);
  EXPECT_GT(map.surface.points.size(), 200U);
  EXPECT_EQ(in_the_middle(map.surface), 0U);
}

TEST_F(Dense, IsInTheEndWhereTheKeyframesAre) {
  start(Mode::kDeterministic);
  worker_->submit(KeyframeId{0}, keyframe(false));
  shift_ = SE3(Eigen::Quaterniond::Identity(), {0.0, 0.0, 100.0});
  const DenseMap map = result();
  EXPECT_EQ(map.moved, 1U);
  ASSERT_GT(map.surface.points.size(), 200U);
  for (const SurfacePoint& point : map.surface.points)
    EXPECT_NEAR(point.position.z(), 100.0F + kWallDepth, 0.02F);
}

TEST_F(Dense, FollowsACorrectionOfTheWholeMapWithTheNextKeyframe) {
  for (const bool is_told : {false, true}) {
    shift_ = SE3();
    start(Mode::kDeterministic);
    EXPECT_EQ(worker_->checkpoint(kHere), nullptr);
    worker_->submit(KeyframeId{0}, keyframe(false));
    EXPECT_NE(worker_->checkpoint(kHere), nullptr) << "as the first call asked for it";
    shift_ = SE3(Eigen::Quaterniond::Identity(), {0.0, 0.0, 0.5});
    if (is_told) worker_->follow_soon();
    worker_->submit(KeyframeId{1}, keyframe(false));
    const auto map = worker_->checkpoint(kHere);
    ASSERT_NE(map, nullptr);
    const bool is_old = std::any_of(map->surface.points.begin(), map->surface.points.end(),
                                    [](const auto& p) { return p.position.z() < kWallDepth + 0.4F; });
    EXPECT_EQ(is_old, !is_told);
    EXPECT_GT(map->surface.points.size(), 200U);
  }
}

TEST_F(Dense, DropsTheOldestRatherThanToMakeAnybodyWait) {
  DenseOptions options;
  options.queue = 2;
  start(Mode::kRealTime, options);
  {
    const std::scoped_lock lock(mutex_);
    is_held_ = true;
  }
  for (unsigned id = 0; id < 8; ++id) worker_->submit(KeyframeId{id}, keyframe(false));  // returns at once
  {
    const std::scoped_lock lock(mutex_);
    is_held_ = false;
    changed_.notify_all();
  }
  const DenseMap map = result();
  EXPECT_GE(map.dropped, 5U);  // one may have been taken up before
  EXPECT_EQ(map.keyframes + map.dropped, 8U);
}

TEST_F(Dense, WhatGoesWrongCostsAKeyframeAndNothingElse) {
  start(Mode::kDeterministic);
  fails_ = true;
  worker_->submit(KeyframeId{0}, keyframe(false));
  fails_ = false;
  worker_->submit(KeyframeId{1}, keyframe(false));
  const DenseMap map = result();
  EXPECT_EQ(map.faults, (std::map<std::string, std::size_t>{{"where that is nobody knows", 1}}));
  EXPECT_EQ(map.keyframes, 1U);
}

TEST_F(Dense, IsEmptyWithoutDepth) {
  start(Mode::kDeterministic);
  DenseInput input = keyframe(true);
  input.frame.depth.release();
  worker_->submit(KeyframeId{0}, input);
  const DenseMap map = result();
  EXPECT_EQ(map.keyframes, 0U);
  EXPECT_TRUE(map.surface.points.empty());
  EXPECT_TRUE(map.removed.empty());
  EXPECT_TRUE(map.faults.empty());
}

TEST_F(Dense, CarriesLabelsFromWhereTheyWereTaken) {
  start(Mode::kDeterministic);
  DenseInput input = keyframe(false);
  const Camera& camera = stage_.camera();
  // Left half building, right half vegetation, taken half a metre to the right of the keyframe: there the
  // line between both lies half a metre to the right of the optical axis.
  input.labels = cv::Mat(camera.height, camera.width, CV_8UC1, cv::Scalar(2));
  input.labels.colRange(camera.width / 2, camera.width).setTo(8);
  input.T_labelled_camera = SE3(Eigen::Quaterniond::Identity(), {-0.5, 0.0, 0.0});
  worker_->submit(KeyframeId{0}, input);
  const DenseMap map = result();
  std::size_t labelled = 0;
  for (const SurfacePoint& point : map.surface.points) {
    if (point.label == 255) continue;
    ++labelled;
    if (std::abs(point.position.x() - 0.5F) < 0.1F) continue;
    EXPECT_EQ(point.label, point.position.x() < 0.5F ? 2 : 8) << point.position.transpose();
  }
  EXPECT_GT(labelled, 200U);
}

}  // namespace
}  // namespace roslam::scene
