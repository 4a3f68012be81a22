// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/restoration/depth_filling.hpp"
#include "simulation/composition/composer.hpp"
#include "simulation/composition/upright.hpp"

namespace roslam {

using namespace simulation;
namespace {

constexpr double kWall = 4.0;    // metres in front of the camera
constexpr double kNoise = 0.02;  // metres that noise of depth stays below up to 2.5 m

// A person of 200 x 80 pixels: a head over a body, green on a blue background.
PersonCutout green_person() {
  cv::Mat mask(200, 80, CV_8UC1, cv::Scalar(0));
  cv::circle(mask, {40, 20}, 20, cv::Scalar(255), cv::FILLED);
  cv::rectangle(mask, cv::Rect(10, 40, 60, 160), cv::Scalar(255), cv::FILLED);
  cv::Mat colour(200, 80, CV_8UC3, cv::Scalar(255, 0, 0));
  colour.setTo(cv::Scalar(0, 255, 0), mask);
  return {"green", colour, mask};
}

// A camera that stands still at the origin, level, and sees a grey wall.
class ComposerTest : public testing::Test {
 protected:
  ComposerTest() {
    camera_.width = 320;
    camera_.height = 240;
    camera_.fx = camera_.fy = 200.0;
    camera_.cx = 160.0;
    camera_.cy = 120.0;
    options_.actors = 1;
    options_.min_distance = options_.max_distance = 2.5;
    options_.span = 0.4;
    options_.camera_height = 1.0;
    for (int i = 0; i <= 300; ++i) poses_.push_back({i / 30.0, SE3()});
  }

  Frame frame(std::size_t index) const {
    Frame frame;
    frame.index = index;
    frame.timestamp = static_cast<double>(index) / 30.0;
    frame.colour = cv::Mat(240, 320, CV_8UC3, cv::Scalar(120, 120, 120));
    frame.depth = cv::Mat(240, 320, CV_32FC1, cv::Scalar(kWall));
    frame.T_world_camera = SE3();
    return frame;
  }

  Composer composer(std::vector<PersonCutout> people = {green_person()}) const {
    return Composer(camera_, people, poses_, options_);
  }

  static double difference(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

  Camera camera_;
  ComposerOptions options_;
  Trajectory poses_;
};

TEST_F(ComposerTest, TheSameSeedGivesTheSameImagesAndAnotherOneOthers) {
  const ComposedFrame first = composer().compose(frame(30));
  const ComposedFrame again = composer().compose(frame(30));
  EXPECT_EQ(difference(first.colour, again.colour), 0.0);
  EXPECT_EQ(difference(first.depth, again.depth), 0.0);
  EXPECT_EQ(difference(first.instances, again.instances), 0.0);
  options_.seed = 2;
  const ComposedFrame other = composer().compose(frame(30));
  EXPECT_GT(difference(first.depth, other.depth), 0.0);
  EXPECT_GT(difference(first.colour, other.colour), 0.0);
}

TEST_F(ComposerTest, OneMoreActorLeavesTheOthersAsTheyAre) {
  options_.actors = 2;
  const Composer two = composer();
  options_.actors = 1;
  const Composer one = composer();
  for (const double time : {0.0, 3.0, 9.0}) {
    EXPECT_EQ(one.actors()[0].walk.feet(time), two.actors()[0].walk.feet(time));
  }
}

TEST_F(ComposerTest, DepthIsThatOfTheActorWithinReliefAndNoise) {
  const ComposedFrame composed = composer().compose(frame(60));
  ASSERT_GT(composed.covered, 0.02);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      const float z = composed.depth.at<float>(y, x);
      if (composed.instances.at<std::uint16_t>(y, x) == 0) {
        EXPECT_TRUE(z == static_cast<float>(kWall) || z == 0.0F);
      } else {
        // Facing the camera from up to 0.4 m aside turns the plane of the person by up to 9 degrees.
        EXPECT_NEAR(z, 2.5 - options_.thickness / 2, options_.thickness / 2 + kNoise + 0.06);
      }
    }
  }
}

TEST_F(ComposerTest, AnActorIsAsHighAsTheProjectionSays) {
  options_.span = 0.0;
  options_.min_height = options_.max_height = 1.7;
  const ComposedFrame composed = composer().compose(frame(0));
  const cv::Rect box = cv::boundingRect(composed.instances > 0);
  EXPECT_NEAR(box.y + box.height, 120 + 200 * 1.0 / 2.5, 1.5);  // feet, 1 m below the camera
  EXPECT_NEAR(box.y, 120 - 200 * 0.7 / 2.5, 1.5);
  EXPECT_NEAR(box.width, 200 * 1.7 / 2.5 * 60.0 / 200.0, 2.0);
  EXPECT_NEAR(box.x + box.width / 2.0, 160, 1.5);
}

TEST_F(ComposerTest, LensDistortionBendsActorsAsEverythingElse) {
  options_.span = 0.0;
  options_.min_height = options_.max_height = 1.7;
  camera_.distortion = {-0.2, 0.0, 0.0, 0.0, 0.0};
  const ComposedFrame composed = composer().compose(frame(0));
  const cv::Rect box = cv::boundingRect(composed.instances > 0);
  const double feet = camera_.distort(camera_.project({0.0, 1.0, 2.5})).y();
  ASSERT_LT(feet, 198.5);  // without distortion 200
  EXPECT_NEAR(box.y + box.height, feet, 1.5);
}

TEST_F(ComposerTest, WhatStandsNearerHidesAnActor) {
  options_.span = 0.0;
  Frame with_pillar = frame(0);
  const cv::Rect pillar(0, 0, 160, 240);  // the left half of the view, and of the person
  with_pillar.depth(pillar) = 1.5F;
  with_pillar.depth(cv::Rect(100, 0, 40, 240)) = 0.0F;  // a stripe of unknown depth on it
  with_pillar.colour(pillar) = cv::Scalar(0, 0, 90);
  const ComposedFrame composed = composer().compose(with_pillar);
  EXPECT_EQ(cv::countNonZero(composed.instances(pillar)), 0);
  EXPECT_GT(cv::countNonZero(composed.instances), 1000);
  EXPECT_EQ(difference(composed.depth(pillar), with_pillar.depth(pillar)), 0.0);
  with_pillar.depth.setTo(1.5F);
  EXPECT_EQ(composer().compose(with_pillar).covered, 0.0);
}

TEST_F(ComposerTest, LabelsAndInstancesAgreeWithWhatChanged) {
  options_.actors = 3;
  const Frame before = frame(45);
  const ComposedFrame composed = composer().compose(before);
  const cv::Mat seen = composed.instances > 0;
  EXPECT_EQ(difference(seen, composed.labels == 11), 0.0);
  EXPECT_EQ(difference(~seen, composed.labels == 255), 0.0);
  EXPECT_NEAR(composed.covered, cv::countNonZero(seen) / (240.0 * 320.0), 1e-12);
  cv::Mat changed;
  cv::absdiff(composed.colour, before.colour, changed);
  cv::cvtColor(changed, changed, cv::COLOR_BGR2GRAY);
  EXPECT_EQ(cv::countNonZero(seen & (changed == 0)), 0);
  cv::Mat around;
  cv::dilate(seen, around, cv::Mat::ones(3, 3, CV_8UC1));
  EXPECT_EQ(cv::countNonZero(~around & (changed > 0)), 0);
}

TEST_F(ComposerTest, NoBackgroundOfTheCutoutShows) {
  const ComposedFrame composed = composer().compose(frame(10));
  for (auto pixel = composed.colour.begin<cv::Vec3b>(); pixel != composed.colour.end<cv::Vec3b>(); ++pixel) {
    EXPECT_LE((*pixel)[0], 120);  // blue, of which the wall has 120 and the image around the person 255
  }
}

TEST_F(ComposerTest, TheShadowLiesOnTheSideAwayFromTheProjector) {
  options_.span = 0.0;
  const auto shadow = [&] { return cv::boundingRect(composer().compose(frame(0)).depth == 0.0F); };
  const cv::Rect person = cv::boundingRect(composer().compose(frame(0)).instances > 0);
  const cv::Rect left = shadow();
  EXPECT_LE(left.x + left.width, person.x + person.width);
  const cv::Rect body = cv::Rect(left.x, 150, left.width, 10);
  EXPECT_NEAR(cv::countNonZero(composer().compose(frame(0)).depth(body) == 0.0F) / 10.0,
              200 * 0.075 * (1 / 2.5 - 1 / kWall), 1.5);
  options_.shadow_baseline = -0.075;
  EXPECT_GE(shadow().x, person.x);
  options_.shadow_baseline = 0.0;
  EXPECT_EQ(shadow().area(), 0);
}

TEST_F(ComposerTest, WithoutActorsInViewNothingChanges) {
  const Frame before = frame(7);
  options_.actors = 0;
  const ComposedFrame nobody = composer({}).compose(before);
  EXPECT_EQ(difference(nobody.colour, before.colour), 0.0);
  EXPECT_EQ(difference(nobody.depth, before.depth), 0.0);
  EXPECT_EQ(nobody.covered, 0.0);
  options_.actors = 2;
  options_.min_distance = options_.max_distance = 6.0;  // behind the wall
  const ComposedFrame hidden = composer().compose(before);
  EXPECT_EQ(difference(hidden.colour, before.colour), 0.0);
  EXPECT_EQ(difference(hidden.depth, before.depth), 0.0);
}

TEST_F(ComposerTest, PeopleWalkAtTheirSpeedOrStand) {
  options_.actors = 5;
  options_.min_distance = 1.0;
  options_.span = 2.0;
  const Composer people = composer();
  const Eigen::Vector3d up = people.ground().up();
  EXPECT_LT((up + Eigen::Vector3d::UnitY()).norm(), 1e-9);
  for (const auto& actor : people.actors()) {
    bool has_walked = false;
    for (double t = 0.0; t < 9.9; t += 0.01) {
      const Eigen::Vector3d at = actor.walk.feet(t);
      EXPECT_GE(at.z(), 1.0 - 1e-9);
      EXPECT_LE(at.z(), 2.5 + 1e-9);
      EXPECT_LE(std::abs(at.x()), 2.0 + 1e-9);
      EXPECT_LE(at.y(), 1.0 + 1e-9);  // the floor; y points down
      EXPECT_GE(at.y(), 1.0 - 0.0201);
      const Eigen::Vector3d moved = actor.walk.feet(t + 0.01) - at;
      const double speed = std::hypot(moved.x(), moved.z()) / 0.01;
      EXPECT_LE(speed, options_.max_speed + 1e-6);
      if (actor.walk.is_walking(t) && actor.walk.is_walking(t + 0.01) && speed > 0.0) has_walked = true;
    }
    EXPECT_TRUE(has_walked);
  }
}

TEST_F(ComposerTest, PeopleStayBeforeACameraThatTravels) {
  options_.max_distance = 3.0;
  options_.span = 0.5;
  poses_.clear();
  for (int i = 0; i <= 1800; ++i) {  // a minute at half a metre a second to the right
    poses_.push_back({i / 30.0, SE3(Eigen::Quaterniond::Identity(), {0.5 * i / 30.0, 0.0, 0.0})});
  }
  const Composer people = composer();
  for (double t = 5.0; t < 55.0; t += 1.0) {
    EXPECT_NEAR(people.actors()[0].walk.feet(t).x(), 0.5 * t, 3.5) << t;
  }
}

TEST_F(ComposerTest, PeopleComeAgainOnlyWhereThereAreTooFew) {
  options_.actors = 4;
  const auto all = chosen_people(10, options_);
  EXPECT_EQ(std::set<std::size_t>(all.begin(), all.end()).size(), 4u);
  EXPECT_EQ(chosen_people(2, options_).size(), 2u);
  EXPECT_EQ(composer().actors().size(), 4u);
}

TEST_F(ComposerTest, OptionsOutOfRangeAreNamed) {
  const auto fails = [&](auto change, const std::string& field) {
    ComposerOptions options;
    change(options);
    try {
      options.validate();
      ADD_FAILURE() << field;
    } catch (const OptionsError& error) {
      EXPECT_NE(std::string(error.what()).find(field), std::string::npos) << error.what();
    }
  };
  fails([](auto& o) { o.max_distance = 1.0; }, "max_distance");
  fails([](auto& o) { o.span = std::nan(""); }, "span");
  fails([](auto& o) { o.actors = 101; }, "actors");
  fails([](auto& o) { o.up = Eigen::Vector3d::Zero(); }, "up");
  fails([](auto& o) { o.min_speed = 0.0; }, "min_speed");
}

TEST(RandomStream, IsTheSameEverywhere) {
  // The standard fixes the 10000th number of the engine with its default seed.
  std::mt19937_64 engine;
  engine.discard(9999);
  EXPECT_EQ(engine(), 9981545732273789042ULL);
  RandomStream random(1);
  double sum = 0.0;
  double squares = 0.0;
  for (int i = 0; i < 100000; ++i) {
    const double value = random.normal();
    EXPECT_LT(std::abs(value), 3.5);
    sum += value;
    squares += value * value;
  }
  EXPECT_NEAR(sum / 100000, 0.0, 0.015);
  EXPECT_NEAR(squares / 100000, 1.0, 0.02);
}

TEST(FilledDepth, TakesTheNeighbourOfTheSameColour) {
  // A red box at 1 m before a grey wall at 3 m; unknown on the box itself and in the shadow on its left.
  cv::Mat colour(60, 100, CV_8UC3, cv::Scalar(120, 120, 120));
  cv::Mat depth(60, 100, CV_32FC1, cv::Scalar(3.0));
  colour(cv::Rect(40, 10, 40, 50)) = cv::Scalar(0, 0, 200);
  depth(cv::Rect(40, 10, 40, 50)) = 1.0F;
  depth(cv::Rect(45, 15, 30, 40)) = 0.0F;
  depth(cv::Rect(30, 10, 10, 50)) = 0.0F;
  const cv::Mat filled = filled_depth(depth, colour);
  EXPECT_EQ(filled.at<float>(30, 60), 1.0F);
  EXPECT_EQ(filled.at<float>(50, 47), 1.0F);
  EXPECT_EQ(filled.at<float>(30, 32), 3.0F);
  EXPECT_EQ(filled.at<float>(30, 36), 3.0F);
  EXPECT_EQ(cv::countNonZero(filled == 0.0F), 0);
  EXPECT_EQ(cv::countNonZero(filled_depth(depth * 0.0, colour)), 0);
}

TEST(UprightEstimate, FindsTheFloorOfACameraThatLooksDown) {
  const Camera camera;
  const double pitch = 0.5;
  // World with z up; the camera 1.5 m above the floor looks along x and down.
  Eigen::Matrix3d R_world_camera;
  R_world_camera << 0, -std::sin(pitch), std::cos(pitch), -1, 0, 0, 0, -std::cos(pitch), -std::sin(pitch);
  const SE3 pose(R_world_camera, {0, 0, 1.5});
  cv::Mat depth(480, 640, CV_32FC1, cv::Scalar(0));
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) {
      const Eigen::Vector3d ray = R_world_camera * camera.unproject({x, y}, 1.0);
      const double to_floor = ray.z() < 0.0 ? -1.5 / ray.z() : 1e9;
      const double to_wall = ray.x() > 0.0 ? 3.0 / ray.x() : 1e9;
      depth.at<float>(y, x) = static_cast<float>(std::min(to_floor, to_wall));
    }
  }
  UprightEstimate estimate(camera);
  EXPECT_FALSE(estimate.up());
  estimate.add(depth, pose);
  ASSERT_TRUE(estimate.up());
  EXPECT_LT((*estimate.up() - Eigen::Vector3d::UnitZ()).norm(), 1e-3);
}

}  // namespace
}  // namespace roslam
