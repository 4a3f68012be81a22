// SPDX-License-Identifier: BSD-3-Clause
// Consistency with the depth of earlier frames: only a surface in space seen free before has moved there.
#include <gtest/gtest.h>

#include "roslam/dynamic_objects/depth_consistency.hpp"
#include "tests/dynamic_scene.hpp"

namespace roslam::scene {
namespace {

constexpr Panel kBox{-0.3, -0.4, 0.3, 0.4, 2.0};

class FreeSpace : public testing::Test {
 protected:
  CellImages cells(const std::vector<Panel>& panels, const SE3& pose = {}) const {
    return {grid_.depth_cells(stage_.show(panels, pose).depth, depth_options_), {}};
  }

  // With what they look like.
  CellImages seen(const std::vector<Panel>& panels, const SE3& pose = {}) const {
    const auto shot = stage_.show(panels, pose);
    return {grid_.depth_cells(shot.depth, depth_options_), grid_.grey_cells(shot.grey)};
  }

  // Cells of a panel, off its border.
  cv::Mat cells_of(const std::vector<Panel>& panels, int number, const SE3& pose = {}) const {
    constexpr int kBorder = 3;
    return inside(grid_.mask_cells(stage_.show(panels, pose).shows(number)), kBorder);
  }

  // A second and a half of the same view.
  void watch(const std::vector<Panel>& panels, const SE3& pose = {}) {
    const CellImages images = cells(panels, pose);
    for (double t = 0.0; t < 1.6; t += 0.25) history_.add(images, pose, t);
  }

  DepthEvidence examine(const std::vector<Panel>& panels, const SE3& pose = {}, double time = 1.75) const {
    return history_.examine(grid_, cells(panels, pose), pose, time);
  }

  static double share_of(const DepthEvidence& evidence, MotionEvidence wanted, const cv::Mat& where) {
    return share_set(where, evidence.state == static_cast<int>(wanted));
  }

  static int count_of(const DepthEvidence& evidence, MotionEvidence wanted) {
    return cv::countNonZero(evidence.state == static_cast<int>(wanted));
  }

  // Depth as a sensor with this noise gives it.
  cv::Mat noisy(const cv::Mat& depth, std::uint64_t seed) const {
    cv::RNG random(seed);
    cv::Mat result = depth.clone();
    for (auto& z : cv::Mat_<float>(result)) {
      z += static_cast<float>(random.gaussian(noise_.sigma(static_cast<double>(z))));
    }
    return result;
  }

  const Stage stage_;
  const CellGrid grid_{stage_.camera()};
  const DepthOptions depth_options_;
  const DepthNoise noise_;
  DynamicObjectOptions options_;
  DepthConsistency history_{options_, noise_};
};

TEST_F(FreeSpace, AThingThatStepsBeforeAWallMovesAndTheWallDoesNot) {
  watch({kWall});
  const std::vector<Panel> now{kWall, kBox};
  const auto evidence = examine(now);
  EXPECT_EQ(share_of(evidence, MotionEvidence::kMoving, cells_of(now, 2)), 1.0);
  EXPECT_EQ(share_of(evidence, MotionEvidence::kStatic, cells_of(now, 1)), 1.0);
  EXPECT_EQ(share_of(evidence, MotionEvidence::kMoving, grid_.mask_cells(stage_.show(now).shows(1))), 0.0);
}

TEST_F(FreeSpace, TellsHowLongASurfaceHasBeenThere) {
  watch({kWall});
  const std::vector<Panel> now{kWall, kBox};
  history_.add(cells(now), {}, 1.75);
  history_.add(cells(now), {}, 2.0);
  const auto evidence = examine(now, {}, 2.3);
  const cv::Point wall(10, 10);
  const cv::Point box(grid_.size().width / 2, grid_.size().height / 2);
  EXPECT_NEAR(evidence.static_for.at<float>(wall), 2.3F, 1e-4F);
  EXPECT_NEAR(evidence.static_for.at<float>(box), 0.55F, 1e-4F);
}

TEST_F(FreeSpace, NothingIsKnownWithoutEarlierFrames) {
  EXPECT_TRUE(history_.empty());
  const auto evidence = examine({kWall});
  EXPECT_EQ(count_of(evidence, MotionEvidence::kUnknown), grid_.size().area());
  EXPECT_EQ(cv::countNonZero(evidence.static_for), 0);
}

TEST_F(FreeSpace, WhatNoFrameSawIsUnknown) {
  watch({kWall});
  const double angle = 0.5;  // of the 63 degrees that the camera sees, 29 are new
  const auto evidence = examine({kWall}, turned(angle));
  const int width = grid_.size().width;
  EXPECT_EQ(cv::countNonZero(evidence.state.colRange(width - width / 3, width)), 0);
  EXPECT_EQ(count_of(evidence, MotionEvidence::kMoving), 0);
  EXPECT_GT(count_of(evidence, MotionEvidence::kStatic), grid_.size().area() / 3);
}

TEST_F(FreeSpace, WhatAThingUncoversDoesNotMove) {
  watch({kWall, kBox});
  const auto evidence = examine({kWall});
  EXPECT_EQ(count_of(evidence, MotionEvidence::kMoving), 0);
  const cv::Mat uncovered = cells_of({kWall, kBox}, 2);
  EXPECT_EQ(share_of(evidence, MotionEvidence::kUnknown, uncovered), 1.0);
}

TEST_F(FreeSpace, NothingMovesBecauseTheCameraDoes) {
  const std::vector<Panel> panels{kWall, kBox};
  // Sideways, ahead and turning, with all that is hidden and uncovered on the way.
  const auto pose_at = [](double t) { return turned(0.15 * t, {0.3 * t, -0.1 * t, 0.4 * t}); };
  for (double t = 0.0; t < 1.6; t += 0.25) history_.add(cells(panels, pose_at(t)), pose_at(t), t);
  const SE3 now = pose_at(1.75);
  const auto evidence = examine(panels, now);
  EXPECT_EQ(count_of(evidence, MotionEvidence::kMoving), 0);
  EXPECT_GT(share_of(evidence, MotionEvidence::kStatic, cells_of(panels, 1, now)), 0.85);
  EXPECT_GT(share_of(evidence, MotionEvidence::kStatic, cells_of(panels, 2, now)), 0.99);
}

TEST_F(FreeSpace, AThingIsSeenToMoveFromAMovingCamera) {
  const auto pose_at = [](double t) { return turned(0.15 * t, {0.3 * t, 0.0, 0.2 * t}); };
  for (double t = 0.0; t < 1.6; t += 0.25) {
    history_.add(cells({kWall, kBox.shifted(-0.8)}, pose_at(t)), pose_at(t), t);
  }
  const std::vector<Panel> moved{kWall, kBox.shifted(0.4)};
  const SE3 now = pose_at(1.75);
  const auto evidence = examine(moved, now);
  EXPECT_GT(share_of(evidence, MotionEvidence::kMoving, cells_of(moved, 2, now)), 0.99);
  EXPECT_EQ(share_of(evidence, MotionEvidence::kMoving, cells_of(moved, 1, now)), 0.0);
}

TEST_F(FreeSpace, NoiseOfDepthIsNoMotionAndHidesNone) {
  const cv::Mat wall = stage_.show({kWall}).depth;
  std::uint64_t seed = 1;
  for (double t = 0.0; t < 1.6; t += 0.25) {
    history_.add({grid_.depth_cells(noisy(wall, seed++), depth_options_), {}}, {}, t);
  }
  const std::vector<Panel> panels{kWall, kBox};
  const CellImages now{grid_.depth_cells(noisy(stage_.show(panels).depth, seed), depth_options_), {}};
  const auto evidence = history_.examine(grid_, now, {}, 1.75);
  EXPECT_EQ(share_of(evidence, MotionEvidence::kMoving, cells_of(panels, 1)), 0.0);
  // Where noise makes depth jump it counts as unknown.
  EXPECT_GT(share_of(evidence, MotionEvidence::kMoving, cells_of(panels, 2) & (now.depth > 0.0F)), 0.95);
}

TEST_F(FreeSpace, AChangeWithinToleranceIsNone) {
  watch({kWall});
  Panel nearer = kWall;
  nearer.z -= 0.15;  // noise explains 0.17 m, and 3 % of the depth may be off
  EXPECT_EQ(count_of(examine({nearer}), MotionEvidence::kMoving), 0);
  EXPECT_GT(count_of(examine({nearer}), MotionEvidence::kStatic), grid_.size().area() * 9 / 10);
  nearer.z = kWall.z - 0.45;
  EXPECT_GT(count_of(examine({nearer}), MotionEvidence::kMoving), grid_.size().area() * 9 / 10);
}

TEST_F(FreeSpace, ASpeckIsNotBelieved) {
  watch({kWall});
  CellImages images = cells({kWall});
  cv::Mat& depth = images.depth;
  depth(cv::Rect(40, 40, 2, 2)).setTo(1.0F);
  EXPECT_EQ(count_of(history_.examine(grid_, images, {}, 1.75), MotionEvidence::kMoving), 0);
  depth(cv::Rect(40, 40, 5, 5)).setTo(1.0F);
  EXPECT_GT(count_of(history_.examine(grid_, images, {}, 1.75), MotionEvidence::kMoving), 15);
}

TEST_F(FreeSpace, OneViewOfManyIsNotBelieved) {
  watch({kWall, kBox});
  history_.add(cells({kWall}), {}, 1.75);
  EXPECT_EQ(count_of(examine({kWall, kBox}, {}, 2.0), MotionEvidence::kMoving), 0);
  history_.add(cells({kWall}), {}, 2.0);
  EXPECT_GT(count_of(examine({kWall, kBox}, {}, 2.25), MotionEvidence::kMoving), 100);
}

TEST_F(FreeSpace, KeepsViewsAtTheIntervalAndForgetsOldOnes) {
  history_.add(cells({kWall}), {}, 0.0);
  history_.add(cells({kWall, kBox}), {}, options_.history_interval / 2);  // too soon to be kept
  EXPECT_GT(count_of(examine({kWall, kBox}, {}, 0.2), MotionEvidence::kMoving), 100);
  history_.add(cells({kWall, kBox}), {}, options_.history + 0.1);  // the first view is too old by now
  const auto evidence = examine({kWall, kBox}, {}, options_.history + 0.2);
  EXPECT_EQ(count_of(evidence, MotionEvidence::kMoving), 0);
  EXPECT_EQ(share_of(evidence, MotionEvidence::kStatic, cells_of({kWall, kBox}, 2)), 1.0);
}

// Most cells take over the votes of another one; each cell is voted on if its neighbours have another depth.
TEST_F(FreeSpace, WhatMovesIsFoundCellByCell) {
  watch({kWall});
  for (const double width : {0.06, 0.1, 0.2}) {
    for (const double x : {-0.4, -0.385, -0.37, 0.1}) {
      const std::vector<Panel> panels{kWall, {x, -0.4, x + width, 0.4, 2.0}};
      const cv::Mat shown = grid_.mask_cells(stage_.show(panels).shows(2)) & (cells(panels).depth > 0.0F);
      const auto evidence = examine(panels);
      const cv::Mat moving = evidence.state == static_cast<int>(MotionEvidence::kMoving);
      EXPECT_EQ(cv::countNonZero(moving & ~shown), 0) << width << ' ' << x;
      EXPECT_EQ(cv::countNonZero(inside(shown, 1) & ~moving), 0) << width << ' ' << x;
    }
  }
}

// What a thing has just covered is narrow, and has the depth of the rest of the thing, which is where it was.
TEST_F(FreeSpace, TheLeadingEdgeOfAThingMoves) {
  for (int i = 0; i < 12; ++i) {
    const double x = -0.3 + 0.005 * i;  // metres; a cell has 0.015 there
    history_.clear();
    const std::vector<Panel> before{kWall, {x, -0.4, x + 0.6, 0.4, 2.0}};
    watch(before);
    cv::Mat seen = grid_.mask_cells(stage_.show(before).shows(2));
    cv::dilate(seen, seen, cv::Mat());  // nothing saw through what lies beside its old place
    for (const double step : {0.05, 0.07, 0.1}) {
      const std::vector<Panel> after{kWall, before[1].shifted(step)};
      const cv::Mat covered = grid_.mask_cells(stage_.show(after).shows(2)) & ~seen;
      ASSERT_GT(cv::countNonZero(covered), 50) << x << ' ' << step;
      // Half of two columns may be at an edge, where depth is unknown.
      EXPECT_GT(share_of(examine(after), MotionEvidence::kMoving, covered), 0.45) << x << ' ' << step;
    }
  }
}

TEST(Cells, BoxesOfNumbersEncloseThem) {
  cv::Mat numbers = cv::Mat::zeros(30, 40, CV_32SC1);
  numbers(cv::Rect(3, 4, 5, 6)).setTo(1);
  numbers(cv::Rect(20, 10, 20, 20)).setTo(3);
  cv::Mat smaller;
  numbers.convertTo(smaller, CV_16U);
  for (const cv::Mat& image : {numbers, smaller}) {
    const auto boxes = boxes_of_numbers(image, 3);
    ASSERT_EQ(boxes.size(), 4U);
    EXPECT_EQ(boxes[1], cv::Rect(3, 4, 5, 6));
    EXPECT_TRUE(boxes[2].empty());
    EXPECT_EQ(boxes[3], cv::Rect(20, 10, 20, 20));
  }
}

// Depth that is wrong in a patch, as stereo cameras measure it on surfaces without texture.
class AppearanceOfTheBackground : public FreeSpace {
 protected:
  static constexpr double kTime = 1.75;   // seconds
  const cv::Rect patch_{60, 40, 20, 30};  // cells

  void watch_closely() {
    for (double t = 0.0; t < 1.6; t += 0.25) history_.add(seen({kWall}), {}, t);
  }

  int moving_in_patch(const CellImages& now, const SE3& pose = {}) const {
    const auto evidence = history_.examine(grid_, now, pose, kTime);
    return cv::countNonZero(evidence.state(patch_) == static_cast<int>(MotionEvidence::kMoving));
  }
};

TEST_F(AppearanceOfTheBackground, ContradictsWrongDepth) {
  watch_closely();
  const SE3 pose = looking_from(0.1, 0.0, 0.0);
  CellImages now = seen({kWall}, pose);
  now.depth(patch_).setTo(2.0);
  EXPECT_LT(moving_in_patch(now, pose), patch_.area() / 100);
  now.grey.release();
  EXPECT_GT(moving_in_patch(now, pose), patch_.area() / 2) << "without the image it seems to move";
}

TEST_F(AppearanceOfTheBackground, AlsoWhenTheExposureChanged) {
  watch_closely();
  CellImages now = seen({kWall});
  now.depth(patch_).setTo(2.0);
  now.grey = 0.6 * now.grey;
  EXPECT_LT(moving_in_patch(now), patch_.area() / 100);
}

TEST_F(AppearanceOfTheBackground, IsHiddenByWhatStepsBeforeIt) {
  watch_closely();
  const std::vector<Panel> now{kWall, kBox};
  CellImages images = seen(now);
  const cv::Mat box = cells_of(now, 2);
  cv::add(images.grey, 40, images.grey, grid_.mask_cells(stage_.show(now).shows(2)));  // textures are alike
  const auto evidence = history_.examine(grid_, images, {}, kTime);
  EXPECT_GT(share_of(evidence, MotionEvidence::kMoving, box), 0.7);
  EXPECT_EQ(share_of(evidence, MotionEvidence::kMoving, cells_of(now, 1)), 0.0);
}

TEST_F(AppearanceOfTheBackground, IsNotComparedBeyondWhatWasSeen) {
  watch_closely();
  const SE3 pose = turned(0.5);
  CellImages now = seen({kWall}, pose);
  const cv::Rect right(grid_.size().width - 20, 40, 20, 30);  // never seen before
  now.depth(right).setTo(2.0);
  const auto evidence = history_.examine(grid_, now, pose, kTime);
  EXPECT_EQ(cv::countNonZero(evidence.state(right) == static_cast<int>(MotionEvidence::kMoving)), 0);
}

}  // namespace
}  // namespace roslam::scene
