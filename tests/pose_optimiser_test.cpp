// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/estimation/pose_optimiser.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "roslam/common/error.hpp"

namespace roslam {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double huber(double squared, double limit) {
  return squared <= limit ? squared : 2.0 * std::sqrt(limit * squared) - limit;
}

class OptimisePose : public testing::Test {
 protected:
  using Measurements = std::vector<PoseMeasurement>;

  double uniform(double from, double to) { return std::uniform_real_distribution<double>(from, to)(random_); }

  SE3 random_motion(double metres, double radians) {
    Vector6d tangent;
    for (int k = 0; k < 6; ++k) tangent(k) = uniform(-1.0, 1.0) * (k < 3 ? metres : radians);
    return SE3::exp(tangent);
  }

  // Exact, of a point in the camera frame of the truth. off: pixels by which it is wrong.
  PoseMeasurement measure(const Eigen::Vector3d& in_camera, bool with_depth,
                          const Eigen::Vector2d& off = {0.0, 0.0}) const {
    PoseMeasurement result{truth_.inverse() * in_camera, {}};
    result.measurement.pixel = camera_.project(in_camera) + off;
    result.measurement.pixel_weight = 1.0 / noise_.pixel_sigma;
    result.measurement.outlier_factor = noise_.outlier_factor;
    if (with_depth) {
      const double z = in_camera.z();
      result.measurement.depth = z;
      result.measurement.depth_weight = z * z / noise_.sigma_of_depth(z);
    }
    return result;
  }

  Eigen::Vector3d random_point(double nearest, double farthest) {
    const Eigen::Vector2d pixel(uniform(0.0, camera_.width), uniform(0.0, camera_.height));
    return camera_.unproject(pixel, uniform(nearest, farthest));
  }

  Measurements scene(int count, bool with_depth) {
    Measurements result;
    for (int i = 0; i < count; ++i) result.push_back(measure(random_point(1.5, 5.0), with_depth));
    return result;
  }

  // What the optimiser minimises over all measurements: the squared errors, those beyond the chi-squared
  // limit after Huber if robust; one behind the camera counts as an outlier.
  double cost(const Measurements& measurements, const SE3& pose, bool robust) const {
    double sum = 0.0;
    for (const auto& [point_world, measurement, weight] : measurements) {
      const Eigen::Vector3d point = pose * point_world;
      const double squared = point.z() <= 1e-3
                                 ? outlier_limit(measurement)
                                 : ReprojectionError{camera_, measurement}.error(point).squaredNorm();
      sum += weight * (robust ? huber(squared, chi_squared_limit(measurement)) : squared);
    }
    return sum;
  }

  // Plain Gauss-Newton on all measurements before the camera, without control of its steps.
  SE3 undamped(const Measurements& measurements, SE3 pose, bool robust, int iterations) const {
    for (int iteration = 0; iteration < iterations; ++iteration) {
      Matrix6d hessian = 1e-9 * Matrix6d::Identity();
      Vector6d gradient = Vector6d::Zero();
      for (const auto& [point_world, measurement, share] : measurements) {
        const Eigen::Vector3d point = pose * point_world;
        if (point.z() <= 1e-3) continue;
        const ReprojectionError term{camera_, measurement};
        const Eigen::Vector3d error = term.error(point);
        Eigen::Matrix<double, 3, 6> jacobian;
        jacobian.leftCols<3>() = term.jacobian(point);
        jacobian.rightCols<3>() = -term.jacobian(point) * skew(point);
        const double limit = chi_squared_limit(measurement);
        const double weight =
            share * (robust && error.squaredNorm() > limit ? std::sqrt(limit / error.squaredNorm()) : 1.0);
        hessian += weight * jacobian.transpose() * jacobian;
        gradient += weight * jacobian.transpose() * error;
      }
      const Vector6d step = -hessian.ldlt().solve(gradient);
      if (!step.allFinite()) break;
      pose = SE3::exp(step) * pose;
    }
    return pose;
  }

  double distance(const SE3& pose) const { return (pose * truth_.inverse()).translation().norm(); }
  double angle(const SE3& pose) const { return (pose * truth_.inverse()).angle(); }

  std::mt19937_64 random_{12};
  Camera camera_;
  MeasurementNoise noise_;
  SE3 truth_ = SE3::exp((Vector6d() << 0.4, -1.0, 0.3, 0.2, -0.4, 0.1).finished());
};

TEST_F(OptimisePose, ExactMeasurementsGiveTheExactPose) {
  for (int problem = 0; problem < 100; ++problem) {
    truth_ = random_motion(3.0, 1.0);
    const bool with_depth = problem % 2 == 0;
    const auto measurements = scene(with_depth ? 10 : 30, with_depth);
    const auto pose = optimise_pose(camera_, measurements, random_motion(0.1, 0.05) * truth_);
    EXPECT_EQ(pose.inliers, static_cast<int>(measurements.size()));
    EXPECT_LT(distance(pose.T_camera_world), 1e-8) << problem;
    EXPECT_LT(angle(pose.T_camera_world), 1e-8) << problem;
  }
}

TEST_F(OptimisePose, ThreePointsWithDepthAreEnoughAndTwoAreNot) {
  const SE3 initial = random_motion(0.05, 0.02) * truth_;
  Measurements measurements{measure({-0.5, -0.3, 2.0}, true), measure({0.6, -0.2, 2.5}, true),
                            measure({0.1, 0.5, 3.0}, true)};
  const auto of_three = optimise_pose(camera_, measurements, initial);
  EXPECT_EQ(of_three.inliers, 3);
  EXPECT_LT(distance(of_three.T_camera_world), 1e-8);
  measurements.pop_back();
  const auto of_two = optimise_pose(camera_, measurements, initial);
  EXPECT_EQ(of_two.inliers, 0);
  EXPECT_EQ(of_two.is_inlier, std::vector<bool>(2, false));
  EXPECT_EQ(of_two.T_camera_world.matrix(), initial.matrix());
  EXPECT_EQ(optimise_pose(camera_, {}, initial).T_camera_world.matrix(), initial.matrix());
}

// Every fourth measurement is wrong, all in one direction.
TEST_F(OptimisePose, OutliersAreSetAside) {
  for (const bool with_depth : {true, false}) {
    Measurements measurements;
    for (int i = 0; i < 80; ++i) {
      const Eigen::Vector2d off(i % 4 == 0 ? 60.0 : 0.0, i % 4 == 0 ? 20.0 : 0.0);
      measurements.push_back(measure(random_point(1.5, 5.0), with_depth, off));
    }
    const SE3 initial = random_motion(0.05, 0.02) * truth_;
    const auto pose = optimise_pose(camera_, measurements, initial);
    for (std::size_t i = 0; i < measurements.size(); ++i) EXPECT_EQ(pose.is_inlier[i], i % 4 != 0) << i;
    EXPECT_EQ(pose.inliers, 60);
    EXPECT_LT(distance(pose.T_camera_world), 1e-6);
    EXPECT_LT(angle(pose.T_camera_world), 1e-6);
    const SE3 with_outliers = undamped(measurements, initial, false, 20);
    EXPECT_GT(angle(with_outliers), 0.01) << "the outliers do not matter";
  }
}

TEST_F(OptimisePose, DepthThatIsWrongMakesAnOutlier) {
  auto measurements = scene(40, true);
  measurements[5].measurement.depth *= 1.2;
  measurements[6].measurement.depth *= 0.8;
  const auto pose = optimise_pose(camera_, measurements, random_motion(0.05, 0.02) * truth_);
  for (std::size_t i = 0; i < measurements.size(); ++i) EXPECT_EQ(pose.is_inlier[i], i != 5 && i != 6) << i;
  EXPECT_LT(distance(pose.T_camera_world), 1e-6);
}

// A wrong derivative would slow convergence down or stop it: with the right ones each step about squares the
// error.
TEST_F(OptimisePose, ConvergesAsFastAsTheRightDerivativesAllow) {
  for (int problem = 0; problem < 50; ++problem) {
    const bool with_depth = problem % 2 == 0;
    const auto measurements = scene(40, with_depth);
    const SE3 initial = random_motion(0.05, 0.03) * truth_;
    const auto few = optimise_pose(camera_, measurements, initial, {.rounds = 1, .iterations = 2});
    EXPECT_LT(distance(few.T_camera_world), 0.1 * distance(initial) + 1e-3) << problem;
    const auto more = optimise_pose(camera_, measurements, initial, {.rounds = 1, .iterations = 6});
    EXPECT_LT(distance(more.T_camera_world), 1e-9) << problem;
    EXPECT_LT(angle(more.T_camera_world), 1e-9) << problem;
  }
}

// The derivative of the error by a motion of the camera, as undamped() above and the optimiser use it.
// Normalised estimation error squared (Bar-Shalom 2001, 5.4): its mean is the number of degrees of freedom,
// 6, if the covariance is true, whatever the unit of the noise.
TEST_F(OptimisePose, TheCovarianceIsThatOfTheError) {
  for (const double scale : {0.3, 1.0}) {
    double sum = 0.0;
    constexpr int kTrials = 400;
    for (int trial = 0; trial < kTrials; ++trial) {
      Measurements measurements = scene(150, true);
      std::normal_distribution<double> noise(0.0, scale);
      for (auto& m : measurements) {
        m.measurement.pixel += Eigen::Vector2d(noise(random_), noise(random_)) / m.measurement.pixel_weight;
        m.measurement.depth = 1.0 / (1.0 / m.measurement.depth + noise(random_) / m.measurement.depth_weight);
      }
      const OptimisedPose pose = optimise_pose(camera_, measurements, random_motion(0.02, 0.01) * truth_);
      const Vector6d error = (truth_ * pose.T_camera_world.inverse()).log();
      sum += error.dot(pose.covariance.ldlt().solve(error));
    }
    // Its standard deviation is sqrt(12 / 400) = 0.17. Huber's weights and rejection at the limit count some
    // of the noise as outliers.
    EXPECT_GT(sum / kTrials, 5.0) << scale;
    EXPECT_LT(sum / kTrials, 8.0) << scale;
  }
}

TEST_F(OptimisePose, TellsHowLargeThePixelErrorsAre) {
  for (const double pixels : {0.5, 1.5, 3.0}) {
    std::normal_distribution<double> normal(0.0, pixels);
    Measurements noisy;
    for (int i = 0; i < 400; ++i) {
      const bool is_wrong = i % 5 == 0;
      const double off = is_wrong ? 30.0 : 0.0;
      noisy.push_back(measure(random_point(1.5, 5.0), true, {off + normal(random_), normal(random_)}));
    }
    const OptimisedPose pose = optimise_pose(camera_, noisy, truth_);
    // A fifth of outliers raises the median by a tenth or so.
    EXPECT_NEAR(pose.pixel_error_scale * noise_.pixel_sigma, 1.15 * pixels, 0.15 * pixels);
  }
  EXPECT_EQ(optimise_pose(camera_, {}, truth_).pixel_error_scale, 0.0);
}

TEST_F(OptimisePose, DerivativesByThePoseAgreeWithNumericOnes) {
  const PoseMeasurement measured = measure({0.4, -0.3, 2.2}, true, {3.0, -2.0});
  const auto& [point_world, measurement, weight] = measured;
  EXPECT_EQ(weight, 1.0);
  const ReprojectionError term{camera_, measurement};
  const Eigen::Vector3d point = truth_ * point_world;
  Eigen::Matrix<double, 3, 6> analytic;
  analytic.leftCols<3>() = term.jacobian(point);
  analytic.rightCols<3>() = -term.jacobian(point) * skew(point);
  constexpr double kStep = 1e-6;
  for (int k = 0; k < 6; ++k) {
    const Vector6d step = kStep * Vector6d::Unit(k);
    const Eigen::Vector3d numeric = (term.error(SE3::exp(step) * truth_ * point_world) -
                                     term.error(SE3::exp(-step) * truth_ * point_world)) /
                                    (2.0 * kStep);
    EXPECT_LT((analytic.col(k) - numeric).norm(), 1e-5 * (1.0 + numeric.norm())) << k;
  }
}

// Few points without depth, some of them near, and an initial pose far off.
class HardProblems : public OptimisePose {
 protected:
  static constexpr int kProblems = 500;

  struct Problem {
    Measurements measurements;
    SE3 initial;
  };

  Problem next() {
    Problem problem;
    const int count = 3 + static_cast<int>(uniform(0.0, 3.0));
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector2d noise(uniform(-2.0, 2.0), uniform(-2.0, 2.0));
      const Eigen::Vector3d point = i % 3 == 0 ? random_point(0.25, 0.6) : random_point(1.0, 2.0);
      problem.measurements.push_back(measure(point, false, noise));
    }
    problem.initial = random_motion(1.0, 0.2) * truth_;
    return problem;
  }

  // The robust cost, where none costs more than one that is just set aside.
  double capped_cost(const Measurements& measurements, const SE3& pose) const {
    double sum = 0.0;
    for (const auto& measurement : measurements) {
      const double most =
          huber(outlier_limit(measurement.measurement), chi_squared_limit(measurement.measurement));
      sum += std::min(cost({measurement}, pose, true), most);
    }
    return sum;
  }
};

// A single round weighs all measurements alike, so that it minimises one and the same cost from start to end.
TEST_F(HardProblems, OneRoundNeverEndsAtAHigherCost) {
  constexpr PoseOptimiserOptions kOneRound{.rounds = 1, .iterations = 20};
  int undamped_ends_higher = 0;
  int ends_lower = 0;
  for (int i = 0; i < kProblems; ++i) {
    auto [measurements, initial] = next();
    // None is set aside: the pose is returned wherever it ends, and points behind the camera cost most.
    for (auto& measurement : measurements) measurement.measurement.outlier_factor = 1e9;
    const double before = cost(measurements, initial, false);
    const auto pose = optimise_pose(camera_, measurements, initial, kOneRound);
    const double after = cost(measurements, pose.T_camera_world, false);
    EXPECT_LE(after, before * (1.0 + 1e-6)) << i;
    const SE3 without_control = undamped(measurements, initial, false, kOneRound.iterations);
    if (cost(measurements, without_control, false) <= before) continue;
    ++undamped_ends_higher;
    ends_lower += after < 0.1 * before ? 1 : 0;
  }
  EXPECT_GE(undamped_ends_higher, 1) << "control of the steps makes no difference";
  EXPECT_GE(ends_lower, 1);
}

// From round to round measurements are set aside; those may fit less well than before, but cost no more.
TEST_F(HardProblems, AllRoundsNeverEndAtAHigherRobustCost) {
  int ends_lower = 0;
  for (int i = 0; i < kProblems; ++i) {
    const auto [measurements, initial] = next();
    const double before = capped_cost(measurements, initial);
    const double after =
        capped_cost(measurements, optimise_pose(camera_, measurements, initial).T_camera_world);
    EXPECT_LE(after, before * (1.0 + 1e-6)) << i;
    ends_lower += after < 0.5 * before ? 1 : 0;
  }
  EXPECT_GT(ends_lower, kProblems / 4) << "it hardly moves";
}

class DegenerateInput : public OptimisePose {
 protected:
  // Whatever comes out, it is no pose that is not finite and passes for one.
  OptimisedPose expect_sound(const Measurements& measurements, const SE3& initial) const {
    const auto pose = optimise_pose(camera_, measurements, initial);
    EXPECT_EQ(pose.is_inlier.size(), measurements.size());
    EXPECT_EQ(std::count(pose.is_inlier.begin(), pose.is_inlier.end(), true), pose.inliers);
    if (pose.inliers > 0) {
      EXPECT_TRUE(pose.T_camera_world.is_finite());
      EXPECT_NEAR(pose.T_camera_world.rotation().norm(), 1.0, 1e-9);
    }
    return pose;
  }
};

TEST_F(DegenerateInput, PointsOnALine) {
  for (const bool with_depth : {true, false}) {
    Measurements measurements;
    for (int i = 0; i < 20; ++i) measurements.push_back(measure({0.1 * i - 1.0, 0.05 * i, 3.0}, with_depth));
    const auto pose = expect_sound(measurements, random_motion(0.05, 0.02) * truth_);
    EXPECT_TRUE(pose.T_camera_world.is_finite());
    EXPECT_LE(cost(measurements, pose.T_camera_world, true), 1e-3) << "a pose fits, though not only one";
  }
}

TEST_F(DegenerateInput, TheCovarianceTellsWhatNothingConstrains) {
  Measurements far;
  for (int i = 0; i < 100; ++i) far.push_back(measure(random_point(900.0, 1000.0), false));
  const Matrix6d covariance = optimise_pose(camera_, far, truth_).covariance;
  for (int k = 0; k < 3; ++k) {
    EXPECT_GT(std::sqrt(covariance(k, k)), 0.1) << k;           // metres
    EXPECT_LT(std::sqrt(covariance(k + 3, k + 3)), 2e-3) << k;  // radians
  }
}

TEST_F(DegenerateInput, PointsAtInfinityGiveTheRotationOnly) {
  Measurements measurements;
  for (int i = 0; i < 30; ++i) measurements.push_back(measure(random_point(1e8, 1e9), false));
  const auto pose = expect_sound(measurements, random_motion(0.05, 0.02) * truth_);
  EXPECT_TRUE(pose.T_camera_world.is_finite());
  EXPECT_LT(angle(pose.T_camera_world), 1e-6);
}

TEST_F(DegenerateInput, OnePointMeasuredManyTimes) {
  for (const bool with_depth : {true, false}) {
    const Measurements measurements(10, measure({0.3, -0.2, 2.0}, with_depth));
    EXPECT_TRUE(expect_sound(measurements, random_motion(0.05, 0.02) * truth_).T_camera_world.is_finite());
  }
}

TEST_F(DegenerateInput, AllPointsBehindTheCamera) {
  auto measurements = scene(20, true);
  for (auto& [point_world, measurement, weight] : measurements) {
    const Eigen::Vector3d in_camera = truth_ * point_world;
    point_world = truth_.inverse() * Eigen::Vector3d(in_camera.x(), in_camera.y(), -in_camera.z());
  }
  EXPECT_EQ(expect_sound(measurements, truth_).inliers, 0);
}

TEST_F(DegenerateInput, ValuesThatAreNotFinite) {
  const SE3 initial = random_motion(0.05, 0.02) * truth_;
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    const auto good = scene(20, true);
    ASSERT_EQ(expect_sound(good, initial).inliers, 20);
    auto pixel = good;
    pixel[3].measurement.pixel.x() = bad;
    EXPECT_FALSE(expect_sound(pixel, initial).is_inlier[3]);
    auto depth = good;
    depth[3].measurement.depth = bad;
    expect_sound(depth, initial);
    auto point = good;
    point[3].point_world.z() = bad;
    EXPECT_FALSE(expect_sound(point, initial).is_inlier[3]);
    auto weight = good;
    weight[3].measurement.pixel_weight = bad;
    expect_sound(weight, initial);
    auto all = good;
    for (auto& measurement : all) measurement.point_world.setConstant(bad);
    EXPECT_EQ(expect_sound(all, initial).inliers, 0);
    EXPECT_EQ(expect_sound(good, SE3(Eigen::Quaterniond::Identity(), {bad, 0, 0})).inliers, 0);
  }
}

TEST(PoseOptimiserLimits, NameTheFieldOutOfRange) {
  EXPECT_NO_THROW(PoseOptimiserOptions{}.validate());
  EXPECT_THROW((PoseOptimiserOptions{.rounds = 0}.validate()), OptionsError);
  EXPECT_THROW((PoseOptimiserOptions{.iterations = 0}.validate()), OptionsError);
}

}  // namespace
}  // namespace roslam
