// SPDX-License-Identifier: BSD-3-Clause
// Optical flow: ego-motion of the camera, and points that do not move with the scene.
#include <gtest/gtest.h>

#include "roslam/dynamic_objects/flow_consistency.hpp"
#include "tests/dynamic_scene.hpp"

namespace roslam::scene {
namespace {

constexpr Panel kPatch{-0.45, -0.45, 0.45, 0.45, 2.5};
constexpr double kDegree = 3.14159265358979 / 180.0;

class Flow : public testing::Test {
 protected:
  PastFrame frame(const std::vector<Panel>& panels, double time, const SE3& pose) const {
    return stage_.past(stage_.show(panels, pose), 0, time, pose);
  }

  // Tracks the corners of a past frame to another one, whose pose is known, and classifies them.
  TrackedPoints follow(const PastFrame& past, PastFrame now) const {
    const auto pose = now.T_camera_world;
    flow_.track(past, now);
    now.T_camera_world = pose;
    return flow_.follow(past, now);
  }

  // The pose of a frame by the flow from the last one.
  std::optional<SE3> camera_pose(const PastFrame& last, PastFrame now, const SE3& predicted) const {
    now.T_camera_world = predicted;
    return flow_.track(last, now);
  }

  static std::size_t count_on(const std::vector<cv::Point2f>& points, const cv::Mat& area) {
    std::size_t count = 0;
    for (const auto& point : points) count += area.at<std::uint8_t>(cv::Point(point)) != 0 ? 1 : 0;
    return count;
  }

  // The window that follows a point sees what lies beside it.
  static cv::Mat far_from(const cv::Mat& area) {
    cv::Mat wider;
    cv::dilate(area, wider, cv::getStructuringElement(cv::MORPH_RECT, {21, 21}));
    return ~wider;
  }

  const Stage stage_;
  const FlowConsistency flow_{stage_.camera(), DynamicObjectOptions{}, DepthOptions{}, MeasurementNoise{},
                              PoseOptimiserOptions{}};
  // Five frames of a hand-held camera: 3 cm and a degree and a half.
  const SE3 moved_ = turned(1.5 * kDegree, {0.02, 0.01, 0.02});
};

TEST_F(Flow, AtRestNothingMovesWhateverTheCameraDoes) {
  const std::vector<Panel> panels{kWall, kPatch};
  for (const SE3& pose : {SE3(), moved_, turned(-4.0 * kDegree), looking_from(0.0, 0.0, 0.15)}) {
    const auto followed = follow(frame(panels, 0.0, {}), frame(panels, 0.13, pose));
    EXPECT_GT(followed.at_rest.size(), 150U);
    EXPECT_TRUE(flow_.in_company(followed).empty());
    EXPECT_LE(followed.moving.size(), followed.at_rest.size() / 50);
    EXPECT_GE(followed.sigma, 1.0);
    EXPECT_LT(followed.sigma, 1.5);
  }
}

TEST_F(Flow, APatchThatMovesOnItsOwnIsFound) {
  const std::vector<Panel> before{kWall, kPatch};
  const std::vector<Panel> after{kWall, kPatch.shifted(0.08, 0.03)};  // 9 pixels
  const View view = stage_.show(after, moved_);
  const auto followed = follow(frame(before, 0.0, {}), stage_.past(view, 4, 0.13, moved_));
  const cv::Mat patch = inside(view.shows(2), 4);
  const std::size_t found = count_on(followed.moving, patch);
  EXPECT_GE(found, 10U);
  EXPECT_LE(10 * count_on(followed.at_rest, patch), found);
  const cv::Mat elsewhere = far_from(view.shows(2));
  EXPECT_EQ(count_on(flow_.in_company(followed), elsewhere), 0U);
  EXPECT_GT(count_on(followed.at_rest, elsewhere), 100U);
  EXPECT_GE(count_on(flow_.in_company(followed), patch), 9 * found / 10);
}

TEST_F(Flow, PointsThatWereRemovedAreFollowedToo) {
  const std::vector<Panel> before{kWall, kPatch};
  const View first = stage_.show(before);
  const PastFrame past = stage_.past(first, 0, 0.0, SE3(), first.shows(2));
  ASSERT_GT(stage_.grid_points(first.shows(2)).inside.size(), 10U);
  const View second = stage_.show(before, moved_);
  const auto followed = follow(past, stage_.past(second, 4, 0.13, moved_));
  EXPECT_GT(count_on(followed.at_rest, second.shows(2)), 10U);
}

TEST_F(Flow, WhatAThingCoversIsNotAtRest) {
  for (const double x : {-0.2, 0.0, 0.2}) {
    const View view = stage_.show({kWall, kPatch.shifted(x, 0.0)}, moved_);
    const auto followed = follow(frame({kWall}, 0.0, {}), stage_.past(view, 4, 0.13, moved_));
    EXPECT_EQ(count_on(followed.at_rest, inside(view.shows(2), 2)), 0U) << x;
    EXPECT_GT(count_on(followed.at_rest, far_from(view.shows(2))), 100U) << x;
  }
}

TEST_F(Flow, TheReturnErrorIsHowFarATrackIsOff) {
  std::vector<CornerMatch> matches;
  const PastFrame before = frame({kWall}, 0.0, {});
  ASSERT_GT(before.corners.size(), 20U);
  std::vector<Corner> off = before.corners;  // tracked to the same place, but for an error of 2 pixels
  for (Corner& corner : off) corner.pixel.x += 2.0F;
  for (std::size_t i = 0; i < off.size(); ++i) matches.push_back({&before.corners[i], &off[i]});
  std::size_t measured = 0;
  for (const float error : return_errors(before.pyramid, before.pyramid, matches)) {
    measured += std::abs(error - 2.0F) < 0.3F ? 1 : 0;
  }
  EXPECT_GT(10 * measured, 8 * matches.size());
}

TEST_F(Flow, WithoutDepthAPointMayLieAnywhereOnItsEpipolarLine) {
  const SE3 sideways = looking_from(0.1, 0.0, 0.0);
  const auto moving_on_patch = [&](double x, double y) {
    const View view = stage_.show({kWall, kPatch.shifted(x, y)}, sideways);
    PastFrame past = frame({kWall, kPatch}, 0.0, {});
    past.depth.release();
    const auto followed = follow(past, stage_.past(view, 4, 0.13, sideways));
    EXPECT_LE(count_on(followed.moving, far_from(view.shows(2))), 2U);
    return count_on(followed.moving, inside(view.shows(2), 4));
  };
  EXPECT_LE(moving_on_patch(-0.06, 0.0), 1U);  // looks like something nearer at rest
  EXPECT_GE(moving_on_patch(0.0, 0.06), 10U);
}

TEST_F(Flow, WithoutPosesNothingIsSaid) {
  PastFrame past = frame({kWall}, 0.0, {});
  PastFrame now = frame({kWall}, 0.13, moved_);
  now.T_camera_world.reset();
  EXPECT_TRUE(follow(past, now).at_rest.empty());
  EXPECT_EQ(flow_.expected(past, now, {30.0F, 40.0F}), cv::Point2f(30.0F, 40.0F));
  past.T_camera_world.reset();
  EXPECT_FALSE(camera_pose(past, now, moved_));
}

TEST_F(Flow, ExpectsAPointWhereItsDepthPutsIt) {
  const SE3 sideways = looking_from(0.1, 0.0, 0.0);
  const PastFrame past = frame({kWall, kPatch}, 0.0, {});
  const PastFrame now = frame({kWall, kPatch}, 0.13, sideways);
  const double f = stage_.camera().fx;
  const cv::Point2f near = flow_.expected(past, now, {160.0F, 120.0F});
  EXPECT_NEAR(static_cast<double>(near.x), 160.0 - 0.1 * f / kPatch.z, 1e-2);
  EXPECT_NEAR(static_cast<double>(near.y), 120.0, 1e-2);
  const cv::Point2f far = flow_.expected(past, now, {60.0F, 50.0F});
  EXPECT_NEAR(static_cast<double>(far.x), 60.0 - 0.1 * f / kWall.z, 1e-2);
}

TEST_F(Flow, FindsHowTheCameraMoved) {
  const std::vector<Panel> panels = room({kPatch});
  const PastFrame last = frame(panels, 0.0, {});
  PastFrame now = frame(panels, 0.033, moved_);
  now.T_camera_world.reset();
  const auto found = camera_pose(last, now, SE3());
  ASSERT_TRUE(found);
  const SE3 error = moved_.inverse() * *found;
  EXPECT_LT(error.translation().norm(), 0.002);
  EXPECT_LT(error.angle(), 0.1 * kDegree);
}

TEST_F(Flow, FindsHowTheCameraMovedThoughAThingMovesToo) {
  const PastFrame last = frame(room({kPatch}), 0.0, {});
  const PastFrame now = frame(room({kPatch.shifted(0.06, -0.04)}), 0.033, moved_);
  const auto found = camera_pose(last, now, SE3());
  ASSERT_TRUE(found);
  EXPECT_LT((moved_.inverse() * *found).translation().norm(), 0.01);
}

TEST_F(Flow, SaysNothingOfTheCameraWhereTooFewPointsAgree) {
  const PastFrame last = frame({kWall}, 0.0, {});
  PastFrame few = last;
  few.corners.resize(15);
  EXPECT_FALSE(camera_pose(few, frame({kWall}, 0.033, moved_), SE3()));
  // The light goes out, so that no point can be tracked.
  PastFrame dark = frame({kWall}, 0.033, moved_);
  dark.pyramid = flow_pyramid(cv::Mat(240, 320, CV_8UC1, cv::Scalar(10)));
  EXPECT_FALSE(camera_pose(last, dark, SE3()));
}

TEST_F(Flow, ACornerTrackedOverSeveralFramesStaysWhereItIsInTheScene) {
  PastFrame last = frame(room(), 0.0, {});
  const PastFrame first = last;
  SE3 pose;
  for (int i = 1; i <= 4; ++i) {
    pose = turned(0.4 * kDegree * i, {0.01 * i, 0.0, 0.01 * i});
    PastFrame now = frame(room(), 0.033 * i, pose);
    flow_.track(last, now);
    last = now;
  }
  last.T_camera_world = pose;
  const auto matches = common_corners(first, last);
  EXPECT_GT(matches.size(), first.corners.size() / 2);
  std::size_t near = 0;
  for (const auto& [from, to] : matches) {
    EXPECT_EQ(from->track, to->track);
    const cv::Point2f error = to->pixel - flow_.expected(first, last, from->pixel);
    near += std::hypot(error.x, error.y) < 1.0F ? 1 : 0;
  }
  EXPECT_GT(near, matches.size() * 9 / 10);
}

TEST(CornerSelection, CornersLieApartAndKeepTheirTracks) {
  CornerSelection selection(small_camera());
  std::vector<Corner> corners;
  const std::vector<cv::Point2f> points{{10.0F, 10.0F}, {11.0F, 11.0F}, {100.0F, 50.0F}, {200.0F, 150.0F}};
  selection.replenish(corners, points, false);
  ASSERT_EQ(corners.size(), 3U) << "one of the two that are close together";
  const auto before = corners;
  selection.replenish(corners, points, false);
  ASSERT_EQ(corners.size(), 3U) << "where one is tracked none is added";
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(corners[i].track, before[i].track);
  corners[1].pixel = corners[0].pixel + cv::Point2f(0.5F, 0.5F);  // they came together
  selection.replenish(corners, {}, false);
  EXPECT_EQ(corners.size(), 2U);
  selection.replenish(corners, {{50.0F, 50.0F}}, true);
  ASSERT_EQ(corners.size(), 3U);
  EXPECT_TRUE(corners.back().is_removed);
  EXPECT_GT(corners.back().track, before.back().track);
}

TEST_F(Flow, OnePointThatMovesProvesNothing) {
  TrackedPoints followed;
  followed.moving = {{50.0F, 50.0F},                                        // alone
                     {200.0F, 60.0F},  {205.0F, 62.0F},                     // two
                     {100.0F, 150.0F}, {105.0F, 150.0F}, {100.0F, 156.0F},  // three near each other
                     {250.0F, 200.0F}, {253.0F, 200.0F}, {250.0F, 203.0F}};
  // Most neighbours of the last three points are static.
  followed.at_rest = {{248.0F, 198.0F}, {255.0F, 198.0F}, {246.0F, 204.0F}};
  const auto found = flow_.in_company(followed);
  ASSERT_EQ(found.size(), 3U);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i], followed.moving[3 + i]);
}

}  // namespace
}  // namespace roslam::scene
