// SPDX-License-Identifier: BSD-3-Clause
// The continuous pose of the body: on tracked frames that are made up, and in simulated flights.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/geometry/mount.hpp"
#include "roslam/odometry/odometry_estimator.hpp"
#include "roslam/slam/run.hpp"
#include "roslam/slam/slam.hpp"
#include "simulation/simulated_flight.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam {
namespace {

using Eigen::Vector3d;
using namespace simulation;

// A body that flies a gentle curve, seen by a map that is corrected now and then.
class MadeUpFlight : public testing::Test {
 protected:
  static constexpr double kStep = 1.0 / 30.0;

  static SE3 T_world_body(double t) {
    return {so3_exp({0.02 * std::sin(t), 0.0, 0.3 * t}), {t, 0.2 * t * t, 0.1}};
  }

  // T_map_world: how the map lies in the world by now.
  TrackedFrame tracked(int i, std::optional<int> since, const SE3& T_map_world = {}) const {
    TrackedFrame frame;
    frame.timestamp = i * kStep;
    frame.state = TrackingState::kTracking;
    frame.quality = 0.9;
    frame.T_camera_world = (T_map_world * T_world_body(i * kStep) * mount_).inverse();
    frame.measurement_covariance = frame.covariance = 1e-6 * Matrix6d::Identity();
    if (since) frame.motion = TrackedMotion{*since * kStep, motion(*since, i)};
    return frame;
  }

  SE3 motion(int from, int to) const {
    return (T_world_body(to * kStep) * mount_).inverse() * T_world_body(from * kStep) * mount_;
  }

  static TrackedFrame without_pose(int i, TrackingState state) {
    TrackedFrame frame;
    frame.timestamp = i * kStep;
    frame.state = state;
    return frame;
  }

  // Feeds frames [first, end), each from the one before; first without one if it is 0.
  std::optional<Odometry> feed(int first, int end, const SE3& T_map_world = {}) {
    std::optional<Odometry> last;
    for (int i = first; i < end; ++i)
      last = add(tracked(i, i > 0 ? std::make_optional(i - 1) : std::nullopt, T_map_world));
    return last;
  }

  std::optional<Odometry> add(const TrackedFrame& frame, SubmapId submap = SubmapId{0}) {
    return estimator_.add(frame, submap);
  }

  static void expect_near(const SE3& a, const SE3& b, double tolerance) {
    EXPECT_LT((a.inverse() * b).log().norm(), tolerance);
  }

  const SE3 mount_ = mounted_camera({0.1, 0.02, -0.05, 0, 20, 0});
  OdometryEstimator estimator_{mount_};
};

TEST_F(MadeUpFlight, IsThatOfTheBody) {
  const auto odometry = feed(0, 60);
  ASSERT_TRUE(odometry);
  expect_near(odometry->T_odom_body, T_world_body(59 * kStep), 0.005);
  expect_near(odometry->T_map_odom, SE3(), 1e-9);
  const SE3 T = T_world_body(59 * kStep);
  const Vector3d velocity(1.0, 0.4 * 59 * kStep, 0.0);
  EXPECT_LT((odometry->linear_velocity - T.rotation().inverse() * velocity).norm(), 0.05);
  EXPECT_NEAR(odometry->angular_velocity.z(), 0.3, 0.02);
  EXPECT_EQ(odometry->resets, 0U);
  EXPECT_EQ(odometry->quality, 0.9);
}

TEST_F(MadeUpFlight, GoesOnWhereTheMapIsCorrected) {
  const auto before = feed(0, 60);
  const SE3 correction(so3_exp({0.01, -0.02, 0.1}), {1.0, -0.5, 0.2});
  const auto after = add(tracked(60, 59, correction));
  ASSERT_TRUE(before && after);
  const SE3 step = before->T_odom_body.inverse() * after->T_odom_body;
  expect_near(step, T_world_body(59 * kStep).inverse() * T_world_body(60 * kStep), 0.005);
  expect_near(after->T_map_odom, correction, 1e-6);
  EXPECT_EQ(after->resets, 0U);
  EXPECT_GT((after->covariance.topLeftCorner<3, 3>().trace()), 0.9) << "odom was off by that metre";
}

TEST_F(MadeUpFlight, AnotherWorldFrameIsNoErrorOfOdom) {
  const auto before = feed(0, 60);
  const SE3 level(so3_exp({0.1, 0, 0}), Vector3d::Zero());
  estimator_.world_changed(level);
  const auto levelled = add(tracked(60, 59, level));
  ASSERT_TRUE(before && levelled);
  EXPECT_LT(levelled->covariance.trace(), 2.0 * before->covariance.trace());
  const SE3 merged(so3_exp({0, 0, 3.0}), {50, 20, 0});
  const auto elsewhere = add(tracked(61, 60, merged), SubmapId{1});
  ASSERT_TRUE(elsewhere);
  EXPECT_LT(elsewhere->covariance.trace(), 2.0 * before->covariance.trace());
  EXPECT_EQ(elsewhere->resets, 0U);
  expect_near(elsewhere->T_odom_body, T_world_body(61 * kStep), 0.005);
  expect_near(elsewhere->T_map_odom, merged, 1e-6);
}

TEST_F(MadeUpFlight, StartsAnewAfterALoss) {
  feed(0, 60);
  for (int i = 60; i < 70; ++i) EXPECT_FALSE(add(without_pose(i, TrackingState::kRecentlyLost)));
  const auto found = add(tracked(70, 59));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->resets, 1U);
  expect_near(found->T_odom_body, T_world_body(70 * kStep), 0.01);
  EXPECT_GT(found->velocity_covariance(0, 0), 1.0) << "not known yet";
}

TEST_F(MadeUpFlight, APoorFitIsWithheldAndNoLoss) {
  feed(0, 60);
  TrackedFrame poor = tracked(60, 59);
  poor.state = TrackingState::kRecentlyLost;
  poor.T_camera_world.reset();
  EXPECT_FALSE(add(poor));
  const auto next = add(tracked(61, 60));
  ASSERT_TRUE(next);
  EXPECT_EQ(next->resets, 0U);
  expect_near(next->T_odom_body, T_world_body(61 * kStep), 0.01);
}

TEST_F(MadeUpFlight, ANewSubmapBeginsWhereTheLastPoseWas) {
  const auto last = feed(0, 60);
  add(without_pose(60, TrackingState::kLost));
  TrackedFrame first = tracked(90, std::nullopt);
  first.T_camera_world =
      (SE3(so3_exp({0.1, 0, 0}), Vector3d::Zero()) * mount_).inverse();  // rolled, in its origin
  const auto odometry = add(first);
  ASSERT_TRUE(last && odometry);
  EXPECT_EQ(odometry->resets, 1U);
  EXPECT_LT((odometry->T_odom_body.translation() - last->T_odom_body.translation()).norm(), 0.01);
  const Vector3d ahead = odometry->T_odom_body.rotation() * Vector3d::UnitX();
  EXPECT_NEAR(std::atan2(ahead.y(), ahead.x()), 0.3 * 59 * kStep, 0.01) << "the heading goes on";
  const Vector3d up = odometry->T_odom_body.rotation().inverse() * Vector3d::UnitZ();
  EXPECT_NEAR(up.y(), std::sin(0.1), 0.005) << "the attitude is the new one";
  expect_near(odometry->T_map_odom * odometry->T_odom_body,
              first.T_camera_world->inverse() * mount_.inverse(), 1e-3);
}

TEST_F(MadeUpFlight, WithdrawnPosesAreTakenBack) {
  feed(0, 60);
  TrackedFrame wrong = tracked(60, 59);
  wrong.motion->T_camera_since =
      SE3(Eigen::Quaterniond::Identity(), {0.3, 0, 0}) * wrong.motion->T_camera_since;
  add(wrong);
  const auto right = add(tracked(61, 59));
  ASSERT_TRUE(right);
  EXPECT_EQ(right->resets, 1U);
  expect_near(right->T_odom_body, T_world_body(61 * kStep), 0.01);
}

TEST_F(MadeUpFlight, PredictedPosesAreLessAndLessCertain) {
  double before = feed(0, 60)->covariance.trace();
  for (int i = 60; i < 80; ++i) {
    TrackedFrame hidden = without_pose(i, TrackingState::kPredicted);
    const auto odometry = add(hidden);
    ASSERT_TRUE(odometry);
    EXPECT_TRUE(odometry->is_predicted);
    EXPECT_EQ(odometry->quality, 0.0);
    EXPECT_GT(odometry->covariance.trace(), before);
    before = odometry->covariance.trace();
  }
  const auto seen = add(tracked(80, 59));
  ASSERT_TRUE(seen);
  EXPECT_LT(seen->covariance.trace(), before);
  EXPECT_EQ(seen->resets, 0U);
}

TEST_F(MadeUpFlight, AResetOfTheClockIsToldAsSuch) {
  feed(0, 60);
  estimator_.restart_clock(5.0);
  TrackedFrame frame = tracked(60, 59);
  frame.timestamp = 5.0 + kStep;
  frame.motion->since = 5.0;
  const auto odometry = add(frame);
  ASSERT_TRUE(odometry);
  EXPECT_EQ(odometry->resets, 1U);
  expect_near(odometry->T_odom_body, T_world_body(60 * kStep), 0.01);
}

// What a simulated flight without traffic shows against its exact truth.
struct Outcome {
  double step = 0.0;      // metres, RMSE from image to image
  double velocity = 0.0;  // m/s, RMSE
  double velocity_in_bounds =
      0;                      // share of frames whose NEES is within the 99 % bounds of 6 degrees of freedom
  double step_in_bounds = 0;  // likewise
  double tilt = 0.0;          // degrees, of the map at the end
};

Outcome fly(const SimulatorOptions& simulated, const std::optional<SE3>& mount = {}) {
  SimulatedSource source(simulated);
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  Camera camera = source.camera();
  if (mount) camera.T_body_camera = *mount;
  Slam slam(camera, options, Mode::kDeterministic);
  const Flight flight(simulated);
  const SE3 T_camera_body = camera.T_body_camera.inverse();
  const auto truth = [&](double t) { return flight.T_world_camera(t) * T_camera_body; };
  Outcome outcome;
  std::optional<Odometry> last;
  int steps = 0, velocities = 0;
  run_slam(source, slam, [&](const Frame& frame, const FrameResult& result) {
    ASSERT_TRUE(result.odometry) << frame.index;
    const Odometry now = *result.odometry;
    EXPECT_EQ(now.resets, 0U);
    const SE3 T_world_body = truth(now.timestamp);
    const Eigen::Quaterniond R_map_world =
        (now.T_map_odom * now.T_odom_body).rotation() * T_world_body.rotation().inverse();
    outcome.tilt = std::acos(std::min(1.0, (R_map_world * Vector3d::UnitZ()).z())) * 180.0 / std::numbers::pi;
    if (last) {
      const SE3 true_step = truth(last->timestamp).inverse() * T_world_body;
      const SE3 off = true_step.inverse() * (last->T_odom_body.inverse() * now.T_odom_body);
      outcome.step += off.translation().squaredNorm();
      Vector6d error;
      error << now.T_odom_body.rotation() * off.translation(),
          now.T_odom_body.rotation() * so3_log(off.rotation());
      outcome.step_in_bounds += error.dot(now.step_covariance.inverse() * error) < 18.55 ? 1 : 0;
      ++steps;
    }
    last = now;
    if (frame.index < 10) return;
    constexpr double h = 1e-3;
    const SE3 a = truth(now.timestamp - h), b = truth(now.timestamp + h);
    Vector6d error;
    error << now.linear_velocity -
                 T_world_body.rotation().inverse() * ((b.translation() - a.translation()) / (2 * h)),
        now.angular_velocity - so3_log(a.rotation().inverse() * b.rotation()) / (2 * h);
    outcome.velocity += error.head<3>().squaredNorm();
    outcome.velocity_in_bounds += error.dot(now.velocity_covariance.inverse() * error) < 18.55 ? 1 : 0;
    ++velocities;
  });
  outcome.step = std::sqrt(outcome.step / steps);
  outcome.step_in_bounds /= steps;
  outcome.velocity = std::sqrt(outcome.velocity / velocities);
  outcome.velocity_in_bounds /= velocities;
  return outcome;
}

TEST(OdometryInFlight, IsSmoothAndKnowsItsErrors) {
  SimulatorOptions street;
  street.traffic = TrafficLevel::kNone;
  street.frames = 150;
  SimulatorOptions gusts = street;
  gusts.gusts = 1.0;
  gusts.seed = 2;
  for (const auto& simulated : {street, gusts}) {
    const Outcome outcome = fly(simulated);
    EXPECT_LT(outcome.step, 0.005) << simulated.gusts;
    EXPECT_LT(outcome.velocity, 0.1) << simulated.gusts;
    EXPECT_GE(outcome.velocity_in_bounds, 0.95) << simulated.gusts;
    EXPECT_GE(outcome.step_in_bounds, 0.95) << simulated.gusts;
    EXPECT_LT(outcome.tilt, simulated.gusts > 0.0 ? 8.0 : 1.2) << "as much as the body is tilted at first";
  }
}

TEST(LevelInFlight, IsThatOfTheMountWhereNothingElseIsKnown) {
  SimulatorOptions simulated;
  simulated.traffic = TrafficLevel::kNone;
  simulated.frames = 30;
  simulated.pitch_down = 20.0 * std::numbers::pi / 180.0;
  simulated.sway = 0.0;
  EXPECT_LT(fly(simulated).tilt, 1.0);
  EXPECT_NEAR(fly(simulated, forward_camera()).tilt, 20.0, 1.0) << "an unknown mount";
}

// At the start the drone accelerates and is tilted, in gusts.
TEST(LevelInFlight, IsFoundByTheAccelerometer) {
  SimulatorOptions simulated;
  simulated.traffic = TrafficLevel::kNone;
  simulated.frames = 110;
  simulated.gusts = 1.0;
  simulated.imu = true;
  EXPECT_LT(fly(simulated).tilt, 1.0);
}

TEST(LevelInFlight, IsGivenByTheProgram) {
  SimulatorOptions simulated;
  simulated.frames = 2;
  SimulatedSource source(simulated);
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  Slam slam(source.camera(), options);
  const SE3 T_world_body(so3_exp({0.1, -0.2, 1.0}), {5, 6, 7});
  slam.set_initial_pose(T_world_body);
  const auto result = slam.process(*source.next());
  ASSERT_TRUE(result.odometry);
  EXPECT_LT((result.odometry->T_odom_body.inverse() * T_world_body).log().norm(), 1e-9);
  EXPECT_LT(((*result.T_world_camera * source.camera().T_body_camera.inverse()).inverse() * T_world_body)
                .log()
                .norm(),
            1e-9);
  EXPECT_THROW(slam.set_initial_pose(T_world_body), Error) << "after the first frame";
}

}  // namespace
}  // namespace roslam
