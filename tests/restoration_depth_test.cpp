// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "roslam/common/error.hpp"
#include "roslam/restoration/depth_completion.hpp"
#include "tests/restoration_scene.hpp"

namespace roslam::scene {
namespace {

const cv::Size kSize(320, 240);

// Depth of a plane n.X = d seen by the small camera.
cv::Mat plane(const Eigen::Vector3d& normal, double distance) {
  const Camera camera = small_camera();
  cv::Mat depth(kSize, CV_32FC1);
  for (int y = 0; y < kSize.height; ++y)
    for (int x = 0; x < kSize.width; ++x)
      depth.at<float>(y, x) = static_cast<float>(distance / normal.dot(camera.unproject({x, y}, 1.0)));
  return depth;
}

cv::Mat box_hole(const cv::Rect& box) {
  cv::Mat hole = cv::Mat::zeros(kSize, CV_8UC1);
  hole(box).setTo(255);
  return hole;
}

cv::Mat without(const cv::Mat& depth, const cv::Mat& hole) {
  cv::Mat result = depth.clone();
  result.setTo(0, hole);
  return result;
}

TEST(DepthCompletion, ContinuesAPlane) {
  const cv::Mat depth = plane({0.3, 0.2, 1.0}, 3.0);
  const cv::Mat hole = box_hole({100, 60, 120, 100});
  const cv::Mat completed = completed_depth(without(depth, hole), hole);
  EXPECT_LT(depth_difference(depth, completed, hole), 0.01);
}

TEST(DepthCompletion, KeepsTheEdgeBetweenFloorAndWall) {
  const cv::Mat wall = plane({0.0, 0.0, 1.0}, 4.0), floor = plane({0.0, 1.0, 0.0}, 1.2);
  cv::Mat depth = wall.clone();
  floor.copyTo(depth, (floor > 0) & (floor < wall));
  const cv::Mat hole = box_hole({130, 110, 60, 110});  // across the edge
  const cv::Mat completed = completed_depth(without(depth, hole), hole);
  EXPECT_LT(depth_difference(depth, completed, hole & (completed > 0)), 0.05);
  EXPECT_EQ(share_set(hole, completed > 0), 1.0);
}

TEST(DepthCompletion, WhatWasRemovedDoesNotBleedIn) {
  const cv::Mat depth = plane({0.0, 0.0, 1.0}, 4.0);
  cv::Mat hole = box_hole({120, 80, 60, 80});
  cv::Mat seen = without(depth, hole);
  // A mask three pixels too small leaves depth of the object along its border.
  cv::Mat border = dilated(hole, 3) & ~hole;
  seen.setTo(1.0, border);
  const cv::Mat completed = completed_depth(seen, hole);
  EXPECT_LT(depth_difference(depth, completed, hole), 0.01);
}

TEST(DepthCompletion, NoiseIsAveragedOut) {
  const cv::Mat depth = plane({0.1, 0.3, 1.0}, 3.0);
  cv::Mat noise(kSize, CV_32FC1);
  cv::RNG random(3);
  random.fill(noise, cv::RNG::NORMAL, 0.0, 0.02);
  const cv::Mat hole = box_hole({110, 70, 90, 90});
  const cv::Mat completed = completed_depth(without(depth + noise, hole), hole);
  EXPECT_LT(depth_difference(depth, completed, hole), 0.02);
}

TEST(DepthCompletion, TheSkyStaysWithoutDepth) {
  const cv::Mat hole = box_hole({120, 20, 60, 60});
  EXPECT_EQ(cv::countNonZero(completed_depth(cv::Mat::zeros(kSize, CV_32FC1), hole)), 0);
  cv::Mat ground = plane({0.0, 1.0, 0.0}, 1.2);
  ground(cv::Rect(0, 0, 320, 140)).setTo(0);
  const cv::Mat completed = completed_depth(ground, hole);  // high above the horizon
  EXPECT_LT(share_set(hole, completed > 0), 0.05);
}

TEST(DepthCompletion, HolesAtTheBorderAndOverAllOfTheImage) {
  const cv::Mat depth = plane({0.2, 0.0, 1.0}, 3.0);
  const cv::Mat corner = box_hole({0, 160, 100, 80});
  EXPECT_LT(depth_difference(depth, completed_depth(without(depth, corner), corner), corner), 0.02);
  const cv::Mat all(kSize, CV_8UC1, cv::Scalar(255));
  EXPECT_EQ(cv::countNonZero(completed_depth(cv::Mat::zeros(kSize, CV_32FC1), all)), 0);
  const cv::Mat none = cv::Mat::zeros(kSize, CV_8UC1);
  EXPECT_EQ(cv::countNonZero(completed_depth(depth, none)), 0);
}

TEST(DepthCompletion, HundredsOfTinyHoles) {
  const cv::Mat depth = plane({0.2, 0.1, 1.0}, 3.0);
  cv::Mat hole = cv::Mat::zeros(kSize, CV_8UC1);
  for (int y = 10; y < kSize.height; y += 12)
    for (int x = 10; x < kSize.width; x += 12) hole(cv::Rect(x, y, 3, 2)).setTo(255);
  const cv::Mat completed = completed_depth(without(depth, hole), hole);
  EXPECT_LT(depth_difference(depth, completed, hole), 0.01);
}

TEST(DepthCompletionOptions, NameTheFieldThatIsOutOfRange) {
  DepthCompletionOptions options;
  options.cell = 0;
  EXPECT_THROW(options.validate(), OptionsError);
}

}  // namespace
}  // namespace roslam::scene
