// SPDX-License-Identifier: BSD-3-Clause
// What a camera can have done between two frames, and what it cannot.
#include "roslam/tracking/pose_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "roslam/common/error.hpp"

namespace roslam {
namespace {

SE3 at(double x, double degrees = 0.0) {
  return {so3_exp({0.0, 0.0, degrees * std::numbers::pi / 180.0}), {x, 0.0, 0.0}};
}

PoseDoubt check(const MotionState& last, double elapsed, const SE3& pose, double sigma = 0.0) {
  return check_motion(last, last.timestamp + elapsed, pose, sigma, PlausibilityOptions{});
}

TEST(PoseCheck, BelievesWhatADroneDoes) {
  const MotionState hovering{5.0, at(0.0), 0.0, Eigen::Vector3d::Zero()};
  const MotionState fast{5.0, at(0.0), 0.0, Eigen::Vector3d(15.0, 0.0, 0.0)};
  for (const double elapsed : {1.0 / 60.0, 1.0 / 30.0, 0.1, 0.2}) {
    // Two g from a hover, a stop with two g, and a turn of 400 degrees a second.
    const double drop = 20.0 * elapsed * elapsed;
    EXPECT_EQ(check(hovering, elapsed, at(drop)), PoseDoubt::kNone) << elapsed;
    EXPECT_EQ(check(fast, elapsed, at(15.0 * elapsed - drop)), PoseDoubt::kNone) << elapsed;
    EXPECT_EQ(check(hovering, elapsed, at(0.0, 400.0 * elapsed)), PoseDoubt::kNone) << elapsed;
  }
}

TEST(PoseCheck, DoubtsAJump) {
  const MotionState hovering{5.0, at(0.0), 0.0, Eigen::Vector3d::Zero()};
  EXPECT_EQ(check(hovering, 0.1, at(1.24)), PoseDoubt::kAcceleration);
  EXPECT_EQ(check(hovering, 1.0 / 30.0, at(0.25)), PoseDoubt::kAcceleration);
  EXPECT_EQ(check(hovering, 0.1, at(3.0)), PoseDoubt::kSpeed);
  EXPECT_EQ(check(hovering, 0.1, at(0.0, 120.0)), PoseDoubt::kTurnRate);
  const MotionState moving{5.0, at(0.0), 0.0, Eigen::Vector3d(3.0, 0.0, 0.0)};
  EXPECT_EQ(check(moving, 0.1, at(-0.5)), PoseDoubt::kAcceleration);
}

TEST(PoseCheck, WithoutAVelocityOnlySpeedAndTurnCount) {
  const MotionState lost{5.0, at(0.0), 0.0, {}};
  EXPECT_EQ(check(lost, 0.1, at(1.24)), PoseDoubt::kNone);
  EXPECT_EQ(check(lost, 0.1, at(3.0)), PoseDoubt::kSpeed);
  // Lost for long, it may be anywhere.
  EXPECT_EQ(check(lost, 10.0, at(100.0, 180.0)), PoseDoubt::kNone);
}

TEST(PoseCheck, AllowsForTheUncertaintyOfBothPoses) {
  MotionState hovering{5.0, at(0.0), 0.0, Eigen::Vector3d::Zero()};
  EXPECT_EQ(check(hovering, 0.1, at(0.8)), PoseDoubt::kAcceleration);
  EXPECT_EQ(check(hovering, 0.1, at(0.8), 0.1), PoseDoubt::kNone);
  hovering.sigma = 0.1;
  EXPECT_EQ(check(hovering, 0.1, at(0.8)), PoseDoubt::kNone);
}

TEST(PoseCheck, SaysNothingWhereNoTimePassed) {
  const MotionState hovering{5.0, at(0.0), 0.0, Eigen::Vector3d::Zero()};
  EXPECT_EQ(check(hovering, 0.0, at(50.0)), PoseDoubt::kNone);
  EXPECT_EQ(check(hovering, -1.0, at(50.0)), PoseDoubt::kNone);
}

Matrix6d covariance(const Eigen::Vector3d& position_sigmas, double rotation_degrees) {
  Vector6d sigmas;
  sigmas << position_sigmas, Eigen::Vector3d::Constant(rotation_degrees * 3.14159265358979 / 180.0);
  return sigmas.array().square().matrix().asDiagonal();
}

TEST(PoseCheck, RefusesWhatIsHardlyConstrained) {
  const PlausibilityOptions options;
  EXPECT_EQ(check_certainty(covariance({0.01, 0.02, 0.2}, 1.0), options), PoseDoubt::kNone);
  EXPECT_EQ(check_certainty(covariance({0.01, 0.02, 0.3}, 1.0), options), PoseDoubt::kUncertain);
  EXPECT_EQ(check_certainty(covariance({0.01, 0.02, 0.01}, 6.0), options), PoseDoubt::kUncertain);
}

// A far wall without depth leaves the distance to it open, whatever the camera's axes.
TEST(PoseCheck, NamesTheDirectionsThatNothingConstrains) {
  const PlausibilityOptions options;
  EXPECT_TRUE(unconstrained_directions(covariance({0.01, 0.04, 0.02}, 0.1), options).empty());
  Matrix6d turned = covariance({0.01, 0.02, 0.2}, 0.1);
  const Eigen::Matrix3d R = so3_exp({0.3, -0.8, 0.2}).toRotationMatrix();
  turned.topLeftCorner<3, 3>() = R * turned.topLeftCorner<3, 3>() * R.transpose();
  const auto one = unconstrained_directions(turned, options);
  ASSERT_EQ(one.size(), 1U);
  EXPECT_NEAR(std::abs(one[0].dot(R.col(2))), 1.0, 1e-9);
  const auto two = unconstrained_directions(covariance({0.1, 0.02, 0.2}, 0.1), options);
  ASSERT_EQ(two.size(), 2U);
  EXPECT_NEAR(std::abs(two[0].z()), 1.0, 1e-9);
  EXPECT_NEAR(std::abs(two[1].x()), 1.0, 1e-9);
}

TEST(PoseCheck, OptionsNameWhatIsOutOfRange) {
  const auto refused = [](auto change) {
    PlausibilityOptions options;
    change(options);
    try {
      options.validate();
    } catch (const OptionsError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refused([](auto& o) { o.min_found_share = 1.0; }).find("min_found_share"), std::string::npos);
  EXPECT_NE(refused([](auto& o) { o.poor_found_share = -0.1; }).find("poor_found"), std::string::npos);
  EXPECT_NE(refused([](auto& o) { o.max_pixel_error = 0.0; }).find("max_pixel"), std::string::npos);
  EXPECT_NE(refused([](auto& o) { o.max_position_sigma = 0.0; }).find("max_position"), std::string::npos);
  EXPECT_NE(refused([](auto& o) { o.max_rotation_sigma = -1.0; }).find("max_rotation"), std::string::npos);
  EXPECT_NE(refused([](auto& o) { o.constrained_sigma = 0.0; }).find("constrained"), std::string::npos);
  EXPECT_NE(refused([](auto& o) { o.max_speed = 0.0; }).find("max_speed"), std::string::npos);
  EXPECT_NE(refused([](auto& o) { o.max_acceleration = std::nan(""); }).find("max_acc"), std::string::npos);
  EXPECT_NE(refused([](auto& o) { o.max_turn_rate = -1.0; }).find("max_turn_rate"), std::string::npos);
  EXPECT_EQ(refused([](auto&) {}), "");
}

}  // namespace
}  // namespace roslam
