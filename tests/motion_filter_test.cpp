// SPDX-License-Identifier: BSD-3-Clause
// Poses filtered into a motion, on motions that are known.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "roslam/odometry/motion_filter.hpp"

namespace roslam {
namespace {

using Eigen::Vector3d;
constexpr double kStep = 1.0 / 30.0;  // seconds

// A smooth flight: a curve with sway.
SE3 pose_at(double t, double vigour) {
  const Vector3d position(t + 0.2 * vigour * std::sin(1.3 * t), 0.3 * vigour * std::sin(0.9 * t + 0.4),
                          0.1 * vigour * std::cos(1.7 * t));
  const Vector3d turn(0.05 * vigour * std::sin(2.1 * t), 0.04 * vigour * std::cos(1.5 * t), 0.3 * t);
  return SE3(so3_exp(turn), position);
}

struct Truth {
  Vector3d velocity;   // odom
  Vector3d turn_rate;  // body
};

Truth motion_at(double t, double vigour) {
  constexpr double h = 1e-4;
  const SE3 a = pose_at(t - h, vigour), b = pose_at(t + h, vigour);
  return {(b.translation() - a.translation()) / (2 * h),
          so3_log(a.rotation().inverse() * b.rotation()) / (2 * h)};
}

struct Outcome {
  std::vector<double> velocity_errors, nees, step_nees, steps;
  double rms_velocity() const {
    double sum = 0.0;
    for (const double e : velocity_errors) sum += e * e;
    return std::sqrt(sum / static_cast<double>(velocity_errors.size()));
  }
  static double share_below(const std::vector<double>& values, double limit) {
    return static_cast<double>(std::ranges::count_if(values, [&](double v) { return v < limit; })) /
           static_cast<double>(values.size());
  }
};

// Measurements with white noise of the covariance that the filter is told.
Outcome fly(double vigour, double sigma, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Matrix6d noise = Matrix6d::Zero();
  const double turn_sigma = sigma / 3.0;
  noise.diagonal() << Vector3d::Constant(sigma * sigma), Vector3d::Constant(turn_sigma * turn_sigma);
  MotionFilter filter;
  Outcome outcome;
  Vector6d last_error = Vector6d::Zero();
  for (int i = 0; i < 600; ++i) {
    const double t = i * kStep;
    const SE3 truth = pose_at(t, vigour);
    const Vector3d shift(normal(random), normal(random), normal(random));
    const Vector3d turn(normal(random), normal(random), normal(random));
    const SE3 measured(so3_exp(turn_sigma * turn) * truth.rotation(), truth.translation() + sigma * shift);
    if (i == 0) {
      filter.start(t, measured, noise);
    } else {
      filter.predict(t);
      filter.update(measured, noise);
    }
    const FilteredMotion& state = filter.state();
    Vector6d error;
    error.head<3>() = state.T_odom_body.translation() - truth.translation();
    error.tail<3>() = so3_log(state.T_odom_body.rotation() * truth.rotation().inverse());
    const Truth motion = motion_at(t, vigour);
    Eigen::Matrix<double, 12, 1> all;
    all << error, state.velocity - motion.velocity, state.turn_rate - motion.turn_rate;
    if (i >= 30) {
      outcome.nees.push_back(all.dot(state.covariance.inverse() * all));
      const Vector6d step = error - last_error;
      outcome.step_nees.push_back(step.dot(state.step_covariance.inverse() * step));
      outcome.velocity_errors.push_back(all.segment<3>(6).norm());
      outcome.steps.push_back(step.head<3>().norm());
    }
    last_error = error;
  }
  return outcome;
}

TEST(MotionFilter, EstimatesVelocityFromNoisyPoses) {
  for (const double vigour : {0.0, 1.0, 4.0}) {
    const Outcome outcome = fly(vigour, 0.003, 1);
    EXPECT_LT(outcome.rms_velocity(), vigour < 2.0 ? 0.07 : 0.12) << vigour;
  }
}

TEST(MotionFilter, SmoothsACalmFlight) {
  const Outcome outcome = fly(0.0, 0.01, 2);
  double sum = 0.0;
  for (const double s : outcome.steps) sum += s * s;
  const double rms = std::sqrt(sum / static_cast<double>(outcome.steps.size()));
  EXPECT_LT(rms, 0.3 * std::sqrt(6.0) * 0.01) << "a third of what the poses alone have";
}

TEST(MotionFilter, KnowsItsCovariance) {
  for (const double vigour : {1.0, 4.0}) {
    const Outcome outcome = fly(vigour, 0.005, 3);
    EXPECT_GT(Outcome::share_below(outcome.nees, 26.2), 0.95) << "99 % of 12 degrees of freedom, " << vigour;
    EXPECT_GT(Outcome::share_below(outcome.step_nees, 16.8), 0.95) << "99 % of 6, " << vigour;
  }
}

TEST(MotionFilter, FollowsASuddenAcceleration) {
  MotionFilter filter;
  const Matrix6d noise = 1e-5 * Matrix6d::Identity();
  constexpr double kAcceleration = 5.0;  // m/s^2, from one image to the next
  const auto since = [](double t) { return std::max(t - 3.0, 0.0); };
  filter.start(0.0, SE3(), noise);
  for (int i = 1; i * kStep < 3.4; ++i) {
    const double t = i * kStep;
    const Vector3d position(0.5 * kAcceleration * since(t) * since(t), 0, 0);
    filter.predict(t);
    filter.update(SE3(Eigen::Quaterniond::Identity(), position), noise);
    EXPECT_LT((filter.state().T_odom_body.translation() - position).norm(), 0.01) << t;
    EXPECT_NEAR(filter.state().velocity.x(), kAcceleration * since(t), 0.35) << t;
  }
}

// The same roll at any heading: the rate is in the body frame, the rotation in odom.
TEST(MotionFilter, TurnsAlikeAtAnyHeading) {
  for (const double yaw : {0.0, 1.5708, 3.1416, -2.0}) {
    MotionFilter filter;
    const Matrix6d noise = 1e-7 * Matrix6d::Identity();
    const Eigen::Quaterniond heading(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()));
    const auto pose = [&](double t) {
      return SE3(heading * so3_exp({2.5 * std::max(t - 1.0, 0.0) * std::max(t - 1.0, 0.0), 0, 0}),
                 Vector3d::Zero());
    };
    filter.start(0.0, pose(0.0), noise);
    for (int i = 1; i * kStep < 1.2; ++i) {
      filter.predict(i * kStep);
      filter.update(pose(i * kStep), noise);
    }
    const double expected = 5.0 * (35 * kStep - 1.0);  // rad/s
    EXPECT_NEAR(filter.state().turn_rate.x(), expected, 0.15) << yaw;
    EXPECT_LT(filter.state().turn_rate.tail<2>().norm(), 0.02) << yaw;
  }
}

// As where the landmarks in view change at once.
TEST(MotionFilter, TakesNoJumpForAMotion) {
  MotionFilter filter;
  const Matrix6d noise = 1e-6 * Matrix6d::Identity();
  filter.start(0.0, SE3(), noise);
  for (int i = 1; i < 120; ++i) {
    const double t = i * kStep;
    filter.predict(t);
    filter.update(SE3(Eigen::Quaterniond::Identity(), {t + (i >= 60 ? 0.03 : 0.0), 0, 0}), noise);
    EXPECT_NEAR(filter.state().velocity.x(), 1.0, i < 30 ? 1.0 : 0.5) << t;
  }
  EXPECT_NEAR(filter.state().T_odom_body.translation().x(), 119 * kStep + 0.03, 0.003)
      << "it follows in the end";
}

TEST(MotionFilter, GrowsItsCovarianceWhileItPredicts) {
  MotionFilter filter;
  const Matrix6d noise = 1e-5 * Matrix6d::Identity();
  filter.start(0.0, SE3(), noise);
  for (int i = 1; i <= 30; ++i) {
    filter.predict(i * kStep);
    filter.update(SE3(Eigen::Quaterniond::Identity(), {i * kStep, 0, 0}), noise);
  }
  double before = filter.state().covariance.topLeftCorner<3, 3>().trace();
  for (int i = 31; i < 60; ++i) {
    filter.predict(i * kStep);
    const double now = filter.state().covariance.topLeftCorner<3, 3>().trace();
    EXPECT_GT(now, before);
    before = now;
  }
  EXPECT_NEAR(filter.state().T_odom_body.translation().x(), 59 * kStep, 0.05) << "goes on at its velocity";
}

}  // namespace
}  // namespace roslam
