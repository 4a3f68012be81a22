// SPDX-License-Identifier: BSD-3-Clause
// From evidence to masks: region growing along the surface of an object, and borders fitted to depth.
#include <gtest/gtest.h>

#include "roslam/dynamic_objects/mask_growth.hpp"
#include "roslam/dynamic_objects/mask_refinement.hpp"
#include "tests/dynamic_scene.hpp"

namespace roslam::scene {
namespace {

class MaskGrowth : public testing::Test {
 protected:
  // The numbers of all cells after growth.
  cv::Mat grown(double metres) const {
    cv::Mat owners = owners_.clone();
    grow_masks(owners, {depth_, barrier_, seeds_, moving_}, grid_, metres);
    return owners;
  }

  void put(const cv::Point& cell, int number) {
    owners_.at<int>(cell) = number;
    seeds_.at<std::uint8_t>(cell) = 255;
  }

  // Expects the cells for which the condition holds to belong to that number, and no others to any.
  template <typename Condition>
  static void expect_owned(const cv::Mat& owners, int number, Condition condition) {
    for (int y = 0; y < owners.rows; ++y) {
      for (int x = 0; x < owners.cols; ++x) {
        ASSERT_EQ(owners.at<int>(y, x), condition(x, y) ? number : 0) << x << ' ' << y;
      }
    }
  }

  static int steps(int x, int y) { return std::abs(x - kSeed.x) + std::abs(y - kSeed.y); }

  static constexpr float kDepth = 2.0F;
  inline static const cv::Point kSeed{80, 60};
  const CellGrid grid_{small_camera()};
  cv::Mat depth_{grid_.size(), CV_32FC1, cv::Scalar(static_cast<double>(kDepth))};
  cv::Mat barrier_ = cv::Mat::zeros(grid_.size(), CV_8UC1);
  cv::Mat seeds_ = cv::Mat::zeros(grid_.size(), CV_8UC1);
  cv::Mat moving_ = cv::Mat::zeros(grid_.size(), CV_8UC1);
  cv::Mat owners_ = cv::Mat::zeros(grid_.size(), CV_32SC1);
  // A cell is 15 mm wide at that depth.
  const double metres_ = 9.5 * static_cast<double>(grid_.side_at(kDepth));
};

TEST_F(MaskGrowth, GoesSoFarAndNoFarther) {
  put(kSeed, 3);
  expect_owned(grown(metres_), 3, [](int x, int y) { return steps(x, y) <= 9; });
  expect_owned(grown(0.0), 3, [](int x, int y) { return steps(x, y) == 0; });
}

TEST_F(MaskGrowth, NeverCrossesADepthJump) {
  put(kSeed, 1);
  depth_.colRange(84, depth_.cols).setTo(kDepth + 0.2F);
  expect_owned(grown(metres_), 1, [](int x, int y) { return steps(x, y) <= 9 && x < 84; });
}

TEST_F(MaskGrowth, FollowsASurfaceThatSlants) {
  put(kSeed, 1);
  for (int x = 0; x < depth_.cols; ++x) depth_.col(x).setTo(kDepth + 0.04F * static_cast<float>(x - kSeed.x));
  const cv::Mat owners = grown(metres_);
  // Cells are wider where the surface is farther.
  EXPECT_EQ(owners.at<int>(kSeed.y, kSeed.x + 8), 1);
  EXPECT_EQ(owners.at<int>(kSeed.y, kSeed.x - 9), 1);
  EXPECT_EQ(owners.at<int>(kSeed.y, kSeed.x + 9), 0);
}

TEST_F(MaskGrowth, StopsAtWhatIsKnownToRest) {
  put(kSeed, 1);
  barrier_.colRange(76, 78).setTo(255);
  expect_owned(grown(metres_), 1, [](int x, int y) { return steps(x, y) <= 9 && x >= 78; });
}

TEST_F(MaskGrowth, DoesNotEnterWhatHasNoDepth) {
  put(kSeed, 1);
  depth_.rowRange(63, 65).setTo(0.0F);
  expect_owned(grown(metres_), 1, [](int x, int y) { return steps(x, y) <= 9 && y < 63; });
}

TEST_F(MaskGrowth, CostsNothingWhereThingsMove) {
  put(kSeed, 1);
  moving_(cv::Rect(kSeed.x, kSeed.y, 40, 1)).setTo(255);
  const cv::Mat owners = grown(metres_);
  EXPECT_EQ(owners.at<int>(kSeed.y, kSeed.x + 39 + 9), 1);
  EXPECT_EQ(owners.at<int>(kSeed.y, kSeed.x + 39 + 10), 0);
  EXPECT_EQ(owners.at<int>(kSeed.y + 9, kSeed.x + 20), 1);
  EXPECT_EQ(owners.at<int>(kSeed.y + 10, kSeed.x + 20), 0);
}

TEST_F(MaskGrowth, BeginsOnlyAtSeeds) {
  owners_.at<int>(kSeed) = 1;
  expect_owned(grown(metres_), 1, [](int x, int y) { return steps(x, y) == 0; });
}

TEST_F(MaskGrowth, TakesNothingFromOtherThings) {
  put(kSeed, 1);
  owners_.colRange(83, 90).setTo(2);
  const cv::Mat owners = grown(metres_);
  EXPECT_EQ(cv::countNonZero(owners == 2), 7 * depth_.rows);
  EXPECT_EQ(owners.at<int>(kSeed.y, 82), 1);
  EXPECT_EQ(owners.at<int>(kSeed.y, 90), 0);
}

class MaskRefinement : public testing::Test {
 protected:
  static constexpr int kBand = 10;

  // A camera of the usual size: cells of four pixels.
  static Camera camera() { return *camera_preset("simulated"); }

  cv::Mat mask(const cv::Rect& box) const {
    cv::Mat image = cv::Mat::zeros(depth_.size(), CV_8UC1);
    image(box).setTo(255);
    return image;
  }

  cv::Mat refined(const cv::Mat& given) const {
    return refine_mask(given, depth_, grid_.depth_cells(depth_, {}), barrier_, grid_, kBand);
  }

  // Largest distance between the borders of a mask and of the truth, in pixels: the least dilation and
  // erosion of the truth that enclose it.
  static int off(const cv::Mat& mask, const cv::Mat& truth) {
    for (int pixels = 0; pixels < 40; ++pixels) {
      if (cv::countNonZero(mask & ~dilated(truth, pixels)) == 0 &&
          cv::countNonZero(inside(truth, pixels) & ~mask) == 0)
        return pixels;
    }
    return 40;
  }

  const CellGrid grid_{camera()};
  cv::Mat depth_{480, 640, CV_32FC1, cv::Scalar(4.0)};
  cv::Mat barrier_ = cv::Mat::zeros(grid_.size(), CV_8UC1);
  const cv::Rect thing_{201, 123, 150, 250};
};

TEST_F(MaskRefinement, SnapsToTheEdgeOfDepth) {
  depth_(thing_).setTo(2.0F);
  const cv::Mat truth = mask(thing_);
  for (const int pixels : {-6, -3, 0, 3, 5}) {
    const cv::Rect box(thing_.x - pixels, thing_.y - pixels, thing_.width + 2 * pixels,
                       thing_.height + 2 * pixels);
    EXPECT_EQ(off(mask(box), truth), std::abs(pixels));
    EXPECT_EQ(off(refined(mask(box)), truth), 0) << pixels;
  }
  for (const cv::Point& shift : {cv::Point(3, 0), cv::Point(-4, 2), cv::Point(-5, 5)}) {
    EXPECT_EQ(off(refined(mask(thing_ + shift)), truth), 0) << shift;
  }
}

TEST_F(MaskRefinement, LeavesTheMaskWhereDepthIsUnknown) {
  depth_(thing_).setTo(2.0F);
  const int middle = thing_.y + thing_.height / 2;
  depth_.rowRange(middle, depth_.rows).setTo(0.0F);
  const cv::Mat given = mask(thing_ + cv::Point(6, 0));
  const cv::Mat result = refined(given);
  EXPECT_EQ(cv::norm(result.rowRange(middle, 480), given.rowRange(middle, 480), cv::NORM_INF), 0.0);
  depth_.setTo(0.0F);
  EXPECT_EQ(cv::norm(refined(given), given, cv::NORM_INF), 0.0);
  depth_.release();
  EXPECT_EQ(cv::norm(refine_mask(given, {}, cv::Mat::zeros(grid_.size(), CV_32FC1), barrier_, grid_, kBand),
                     given, cv::NORM_INF),
            0.0);
}

TEST_F(MaskRefinement, AddsNothingAtABarrier) {
  depth_(thing_).setTo(2.0F);
  barrier_.setTo(255);
  const cv::Rect smaller(thing_.x + 5, thing_.y + 5, thing_.width - 10, thing_.height - 10);
  EXPECT_EQ(cv::norm(refined(mask(smaller)), mask(smaller), cv::NORM_INF), 0.0);
}

TEST_F(MaskRefinement, ReachesNoFartherThanItsBand) {
  depth_(thing_).setTo(2.0F);
  const cv::Rect part(thing_.x + 60, thing_.y + 60, 50, 60);
  const cv::Mat result = refined(mask(part));
  EXPECT_EQ(cv::countNonZero(result & ~dilated(mask(part), kBand)), 0);
  EXPECT_EQ(cv::countNonZero(dilated(mask(part), kBand / 2) & ~result), 0);
}

TEST_F(MaskRefinement, KeepsThinThings) {
  const cv::Rect pole(300, 100, 9, 200);
  depth_(pole).setTo(2.0F);
  const cv::Mat result = refined(mask(pole));
  EXPECT_GT(share_set(mask(pole), result), 0.95);
  EXPECT_LT(cv::countNonZero(result), pole.area() * 11 / 10);
}

TEST_F(MaskRefinement, LeavesAnEmptyMaskEmpty) {
  EXPECT_EQ(cv::countNonZero(refined(cv::Mat::zeros(depth_.size(), CV_8UC1))), 0);
}

TEST(Dilated, WidensBySoManyPixels) {
  cv::Mat image = cv::Mat::zeros(60, 80, CV_8UC1);
  image(cv::Rect(30, 20, 10, 5)).setTo(255);
  EXPECT_EQ(cv::boundingRect(dilated(image, 4)), cv::Rect(26, 16, 18, 13));
  EXPECT_EQ(cv::countNonZero(dilated(image, 4)), 18 * 13);
  EXPECT_EQ(cv::countNonZero(dilated(image, 0)), 50);
}

}  // namespace
}  // namespace roslam::scene
