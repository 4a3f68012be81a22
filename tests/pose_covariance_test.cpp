// SPDX-License-Identifier: BSD-3-Clause
// The covariance of poses, against the exact truth of simulated flights.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "roslam/slam/run.hpp"
#include "roslam/slam/slam.hpp"
#include "roslam/tracking/pose_covariance.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam {
namespace {

using namespace simulation;

// Normalised estimation error squared of each tracked frame of a flight.
std::vector<double> errors_of_flight(FlightPath path, std::uint32_t seed) {
  SimulatorOptions simulated;
  simulated.path = path;
  simulated.traffic = TrafficLevel::kNone;
  simulated.frames = 200;
  simulated.seed = seed;
  SimulatedSource source(simulated);
  Options options;
  options.dynamic_objects = *options_of_mode("none", options.dynamic_objects);
  Slam slam(source.camera(), options, Mode::kDeterministic);
  std::vector<double> result;
  std::optional<SE3> T_map_world;  // the map begins at the first camera
  run_slam(source, slam, [&](const Frame& frame, const FrameResult& tracked) {
    if (!tracked.T_world_camera) return;
    if (!T_map_world) {
      T_map_world = *tracked.T_world_camera * frame.T_world_camera->inverse();
      EXPECT_TRUE(tracked.covariance.isZero()) << "the first camera defines the map";
      return;
    }
    const SE3 truth = *T_map_world * *frame.T_world_camera;
    Vector6d error;
    error.head<3>() = tracked.T_world_camera->translation() - truth.translation();
    error.tail<3>() = (*tracked.T_world_camera * truth.inverse()).log().tail<3>();
    result.push_back(error.dot(tracked.covariance.inverse() * error));
  });
  return result;
}

// Six degrees of freedom: the mean is 6 if the covariance is right, and 99 % are below 16.8. The errors of a
// flight depend on each other, so that several flights count together.
TEST(PoseCovarianceInFlight, IsThatOfTheErrorAgainstTheTruth) {
  std::vector<double> errors;
  for (const auto& [path, seed] : {std::pair(FlightPath::kStreet, 1U), std::pair(FlightPath::kHover, 1U),
                                   std::pair(FlightPath::kTurn, 3U), std::pair(FlightPath::kStreet, 5U)}) {
    const auto flight = errors_of_flight(path, seed);
    EXPECT_GT(flight.size(), 195U);
    errors.insert(errors.end(), flight.begin(), flight.end());
  }
  const double count = static_cast<double>(errors.size());
  const double mean = std::accumulate(errors.begin(), errors.end(), 0.0) / count;
  EXPECT_GT(mean, 3.0);
  EXPECT_LT(mean, 12.0);
  EXPECT_GE(static_cast<double>(std::ranges::count_if(errors, [](double e) { return e < 16.8; })),
            0.95 * count);
}

Matrix6d diagonal(double position, double rotation) {
  Vector6d sigmas;
  sigmas << Eigen::Vector3d::Constant(position), Eigen::Vector3d::Constant(rotation);
  return sigmas.array().square().matrix().asDiagonal();
}

SE3 some_pose(double s) {
  return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.8 * s, Eigen::Vector3d(0.3, -0.5, 0.7).normalized())),
             Eigen::Vector3d(0.4, -1.2 * s, 2.0));
}

TEST(CarriedCovariance, IsThatOfThePoseThatMovesAlong) {
  // Perturbed poses of one camera and of another fixed to it.
  const SE3 T_a_world = some_pose(1.0), T_b_a = some_pose(-0.6);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  Matrix6d sum = Matrix6d::Zero();
  const Matrix6d of_a = diagonal(0.01, 0.004);
  constexpr int kTrials = 20000;
  for (int i = 0; i < kTrials; ++i) {
    Vector6d x;
    for (int k = 0; k < 6; ++k) x(k) = normal(random) * std::sqrt(of_a(k, k));
    const SE3 b = T_b_a * SE3::exp(x) * T_a_world;
    const Vector6d off = (b * (T_b_a * T_a_world).inverse()).log();
    sum += off * off.transpose() / kTrials;
  }
  const Matrix6d expected = carried(of_a, T_b_a);
  EXPECT_LT((sum - expected).norm(), 0.05 * expected.norm());
}

TEST(CovarianceInTheWorld, IsThatOfPositionAndRotation) {
  const SE3 T_camera_world = some_pose(1.0);
  Matrix6d by_camera = diagonal(0.01, 0.002);
  by_camera(0, 0) *= 9.0;
  by_camera(4, 4) *= 16.0;
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  Matrix6d sum = Matrix6d::Zero();
  constexpr int kTrials = 20000;
  const SE3 truth = T_camera_world.inverse();
  for (int i = 0; i < kTrials; ++i) {
    Vector6d x;
    for (int k = 0; k < 6; ++k) x(k) = normal(random) * std::sqrt(by_camera(k, k));
    const SE3 pose = (SE3::exp(x) * T_camera_world).inverse();
    Vector6d error;
    error.head<3>() = pose.translation() - truth.translation();
    error.tail<3>() = (pose * truth.inverse()).log().tail<3>();
    sum += error * error.transpose() / kTrials;
  }
  const Matrix6d expected = covariance_in_world(truth, by_camera);
  EXPECT_LT((sum - expected).norm(), 0.05 * expected.norm());
}

TEST(PredictedCovariance, GrowsWithTime) {
  Matrix6d last = diagonal(0.01, 0.002);
  double before = last.trace();
  for (const double seconds : {0.033, 0.1, 0.3, 1.0}) {
    const double now = PoseCovariance::of_prediction(last, {}, seconds).trace();
    EXPECT_GT(now, before) << seconds;
    before = now;
  }
}

TEST(CovarianceOfAFrame, AddsThatOfTheKeyframesThatCreatedItsLandmarks) {
  Map map({1.0F});
  auto view = std::make_shared<ObservedFrame>();
  view->pixels.assign(4, {100.0F, 100.0F});
  view->depths.assign(4, 2.0F);
  view->levels.assign(4, 0);
  view->angles.assign(4, 0.0F);
  view->colours.assign(4, {});
  view->descriptors.assign(4, {});
  const KeyframeId first = map.insert(Keyframe{{}, 0, 0.0, SE3(), view, {}, SubmapId{0}, 0});
  const KeyframeId second = map.insert(Keyframe{{}, 1, 1.0, SE3(), view, {}, SubmapId{0}, 0});
  std::vector<LandmarkId> landmarks;
  for (std::uint32_t i = 0; i < 3; ++i) landmarks.push_back(map.add_landmark({0, 0, 2}, first, i));
  landmarks.push_back(map.add_landmark({0, 0, 2}, second, 3));
  landmarks.emplace_back();  // a point without one
  PoseCovariance covariance;
  const Matrix6d measured = diagonal(0.01, 0.001);
  const Matrix6d alone = covariance.of_frame(map, {}, landmarks, measured);
  EXPECT_GE(alone.trace(), measured.trace());
  const Matrix6d of_first = diagonal(0.1, 0.02), of_second = diagonal(0.3, 0.05);
  covariance.add_keyframe(first, of_first);
  covariance.add_keyframe(second, of_second);
  const Matrix6d all = covariance.of_frame(map, {}, landmarks, measured);
  EXPECT_TRUE(all.isApprox(alone + 0.75 * of_first + 0.25 * of_second, 1e-12));
}

}  // namespace
}  // namespace roslam
