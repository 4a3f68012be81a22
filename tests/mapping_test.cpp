// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "roslam/map/map.hpp"
#include "roslam/mapping/bundle_adjustment.hpp"
#include "roslam/mapping/bundle_cost.hpp"
#include "roslam/mapping/culling.hpp"
#include "roslam/mapping/new_landmarks.hpp"

namespace roslam {
namespace {

template <int kRows>
void check_jacobians(const Measurement& measurement) {
  const Camera camera;
  const Eigen::Quaterniond initial = so3_exp({0.1, -0.2, 0.3});
  const BundleCost<kRows> cost(camera, measurement, initial);
  std::array<double, 6> pose{0.1, -0.2, 0.4, 0.05, -0.1, 0.08};
  std::array<double, 3> point{0.3, 0.2, 2.5};
  const std::array<const double*, 2> parameters{pose.data(), point.data()};
  std::array<double, kRows> residual{};
  std::array<double, kRows * 6> by_pose{};
  std::array<double, kRows * 3> by_point{};
  std::array<double*, 2> jacobians{by_pose.data(), by_point.data()};
  ASSERT_TRUE(cost.Evaluate(parameters.data(), residual.data(), jacobians.data()));
  constexpr double kStep = 1e-6;
  const auto check = [&](double& parameter, const double* analytic, int columns, int column) {
    std::array<double, kRows> plus{};
    std::array<double, kRows> minus{};
    const double value = parameter;
    parameter = value + kStep;
    cost.Evaluate(parameters.data(), plus.data(), nullptr);
    parameter = value - kStep;
    cost.Evaluate(parameters.data(), minus.data(), nullptr);
    parameter = value;
    for (std::size_t row = 0; row < kRows; ++row) {
      const double numeric = (plus[row] - minus[row]) / (2 * kStep);
      EXPECT_NEAR(analytic[static_cast<int>(row) * columns + column], numeric,
                  1e-4 * (1.0 + std::abs(numeric)))
          << "row " << row << " column " << column;
    }
  };
  for (int c = 0; c < 6; ++c) check(pose[static_cast<std::size_t>(c)], by_pose.data(), 6, c);
  for (int c = 0; c < 3; ++c) check(point[static_cast<std::size_t>(c)], by_point.data(), 3, c);
}

TEST(BundleCost, JacobiansAgreeWithNumericOnes) {
  check_jacobians<3>(Measurement::make({320.0F, 250.0F}, 2.4F, 1.2F, {}));
  check_jacobians<2>(Measurement::make({320.0F, 250.0F}, 0.0F, 1.2F, {}));
}

// Eight cameras on an arc around a cloud of points.
class Bundle : public testing::Test {
 protected:
  void SetUp() override {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int i = 0; i < 8; ++i) {
      Vector6d tangent;
      tangent << 0.15 * i, 0.02 * i, 0.03 * i, 0.01 * i, -0.04 * i, 0.005 * i;
      truth_.poses.push_back({SE3::exp(tangent), i == 0});
    }
    for (int p = 0; p < 150; ++p) {
      truth_.points.emplace_back(1.5 * uniform(generator_), uniform(generator_), 3.0 + uniform(generator_));
    }
  }

  void observe(double noise) {
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < truth_.poses.size(); ++i) {
      for (std::size_t p = 0; p < truth_.points.size(); ++p) {
        const Eigen::Vector3d in_camera = truth_.poses[i].T_camera_world * truth_.points[p];
        const Eigen::Vector2d pixel =
            camera_.project(in_camera) + noise * Eigen::Vector2d(normal(generator_), normal(generator_));
        const double depth =
            in_camera.z() + noise * noise_.sigma_of_depth(in_camera.z()) * normal(generator_);
        truth_.terms.push_back(
            {i, p,
             Measurement::make(pixel.cast<float>(), p % 3 == 0 ? 0.0F : static_cast<float>(depth), 1.0F,
                               noise_)});
      }
    }
  }

  BundleProblem disturbed() {
    std::normal_distribution<double> normal;
    BundleProblem problem = truth_;
    for (auto& pose : problem.poses) {
      if (pose.is_fixed) continue;
      Vector6d off;
      for (int k = 0; k < 6; ++k) off[k] = 0.02 * normal(generator_);
      pose.T_camera_world = SE3::exp(off) * pose.T_camera_world;
    }
    for (auto& point : problem.points) {
      point += 0.05 * Eigen::Vector3d(normal(generator_), normal(generator_), normal(generator_));
    }
    return problem;
  }

  double worst_pose_error(const BundleProblem& problem) const {
    double worst = 0.0;
    for (std::size_t i = 0; i < problem.poses.size(); ++i) {
      const SE3 off = problem.poses[i].T_camera_world * truth_.poses[i].T_camera_world.inverse();
      worst = std::max(worst, off.log().norm());
    }
    return worst;
  }

  Camera camera_;
  MeasurementNoise noise_;
  std::mt19937 generator_{11};
  BundleProblem truth_;
  BundleAdjustmentOptions options_{.iterations = 30};
};

TEST_F(Bundle, RecoversTheTruthWithoutNoise) {
  observe(0.0);
  BundleProblem problem = disturbed();
  EXPECT_GT(worst_pose_error(problem), 0.02);
  const BundleSummary summary = adjust_bundle(camera_, problem, options_);
  EXPECT_TRUE(summary.is_usable);
  EXPECT_LT(summary.final_cost, 1e-3 * summary.initial_cost);
  EXPECT_LT(worst_pose_error(problem), 1e-3);
}

TEST_F(Bundle, LeavesFixedPosesAlone) {
  observe(1.0);
  BundleProblem problem = disturbed();
  adjust_bundle(camera_, problem, options_);
  EXPECT_EQ((problem.poses[0].T_camera_world.matrix() - truth_.poses[0].T_camera_world.matrix()).norm(), 0.0);
}

TEST_F(Bundle, StandsNoiseAndOutliers) {
  observe(1.0);
  for (std::size_t t = 0; t < truth_.terms.size(); t += 29) truth_.terms[t].measurement.pixel.x() += 40.0;
  BundleProblem problem = disturbed();
  adjust_bundle(camera_, problem, options_);
  EXPECT_LT(worst_pose_error(problem), 0.02);
  const auto is_inlier = bundle_inliers(camera_, problem);
  for (std::size_t t = 0; t < truth_.terms.size(); t += 29) EXPECT_FALSE(is_inlier[t]) << t;
  const auto inliers = std::count(is_inlier.begin(), is_inlier.end(), true);
  EXPECT_GT(static_cast<double>(inliers), 0.95 * static_cast<double>(truth_.terms.size()));
}

TEST_F(Bundle, RepeatsBitByBit) {
  observe(1.0);
  const BundleProblem start = disturbed();
  BundleProblem a = start;
  BundleProblem b = start;
  adjust_bundle(camera_, a, options_);
  adjust_bundle(camera_, b, options_);
  for (std::size_t p = 0; p < a.points.size(); ++p) EXPECT_EQ(a.points[p], b.points[p]);
}

TEST_F(Bundle, StopsWhenAsked) {
  observe(0.0);
  BundleProblem problem = disturbed();
  const BundleSummary summary = adjust_bundle(camera_, problem, options_, [] { return true; });
  EXPECT_LE(summary.iterations, 2);
}

TEST(Triangulate, FindsTheCrossing) {
  const Eigen::Vector3d point(0.4, -0.3, 2.0);
  const Eigen::Vector3d a(0, 0, 0);
  const Eigen::Vector3d b(0.5, 0.1, 0);
  const auto found = triangulate(a, point - a, b, 3.0 * (point - b));
  ASSERT_TRUE(found.has_value());
  EXPECT_LT((*found - point).norm(), 1e-12);
  EXPECT_FALSE(triangulate(a, {0, 0, 1}, b, {0, 0, 2}).has_value());
}

class MapTest : public testing::Test {
 protected:
  MapTest() : map_({1.0F, 1.2F, 1.44F}) {}

  KeyframeId add_keyframe(double x) {
    auto view = std::make_shared<ObservedFrame>();
    for (std::uint64_t i = 0; i < 20; ++i) {
      view->pixels.emplace_back(10.0F * static_cast<float>(i), 100.0F);
      view->depths.push_back(2.0F);
      view->levels.push_back(0);
      view->angles.push_back(0.0F);
      view->colours.emplace_back(1, 2, 3);
      view->descriptors.push_back({i, i * i, 0, 0});
    }
    return map_.add_keyframe(0, x, SE3(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0, 0)), view);
  }

  Map map_;
};

TEST_F(MapTest, KeepsBothSidesOfAnObservation) {
  const KeyframeId a = add_keyframe(0.0);
  const KeyframeId b = add_keyframe(0.1);
  const LandmarkId landmark = map_.add_landmark({0, 0, 2}, a, 3);
  EXPECT_TRUE(map_.add_observation(landmark, b, 4));
  EXPECT_FALSE(map_.add_observation(landmark, b, 5)) << "a keyframe sees a landmark once";
  EXPECT_EQ(map_.find(b)->landmarks[4], landmark);
  EXPECT_EQ(map_.covisible(a).front(), std::make_pair(b, 1));
  map_.remove_observation(landmark, a);
  EXPECT_FALSE(map_.find(a)->landmarks[3].is_valid());
  map_.remove_observation(landmark, b);
  EXPECT_EQ(map_.find(landmark), nullptr) << "unseen, it goes";
  EXPECT_EQ(map_.landmark_count(), 0U);
}

TEST_F(MapTest, MergingMovesObservationsAndIsRemembered) {
  const KeyframeId a = add_keyframe(0.0);
  const KeyframeId b = add_keyframe(0.1);
  const LandmarkId first = map_.add_landmark({0, 0, 2}, a, 3);
  const LandmarkId second = map_.add_landmark({0, 0, 2.01}, b, 4);
  map_.merge_landmarks(second, first);
  EXPECT_EQ(map_.find(second), nullptr);
  EXPECT_EQ(map_.resolve(second), first);
  EXPECT_EQ(map_.find(b)->landmarks[4], first);
  EXPECT_EQ(map_.find(first)->observations.size(), 2U);
}

TEST_F(MapTest, PoseOfARemovedKeyframeFollowsItsAnchor) {
  const KeyframeId a = add_keyframe(0.0);
  const KeyframeId b = add_keyframe(0.5);
  const SE3 before = map_.T_camera_world(b) * map_.T_camera_world(a).inverse();
  map_.remove_keyframe(b, a);
  EXPECT_EQ(map_.keyframe_count(), 1U);
  map_.find(a)->T_camera_world = SE3::exp((Vector6d() << 1, 2, 3, 0.1, 0.2, 0.3).finished());
  const SE3 after = map_.T_camera_world(b) * map_.T_camera_world(a).inverse();
  EXPECT_LT((before.matrix() - after.matrix()).norm(), 1e-12);
}

TEST_F(MapTest, RedundantKeyframesGo) {
  std::vector<KeyframeId> keyframes;
  for (int i = 0; i < 8; ++i) keyframes.push_back(add_keyframe(0.01 * i));
  for (std::uint32_t p = 0; p < 20; ++p) {
    const LandmarkId landmark = map_.add_landmark({0.1 * p, 0, 2}, keyframes[0], p);
    for (std::size_t k = 1; k < keyframes.size(); ++k) map_.add_observation(landmark, keyframes[k], p);
  }
  const int removed = cull_keyframes(map_, keyframes.back(), {});
  EXPECT_GE(removed, 3);
  EXPECT_NE(map_.find(keyframes.front()), nullptr) << "the first keyframe holds the world in place";
  EXPECT_NE(map_.find(keyframes.back()), nullptr);
  EXPECT_EQ(map_.landmark_count(), 20U);
}

TEST_F(MapTest, LandmarksNotFoundAgainGo) {
  const KeyframeId a = add_keyframe(0.0);
  LandmarkCuller culler{CullingOptions{}};
  const LandmarkId good = map_.add_landmark({0, 0, 2}, a, 0);
  const LandmarkId bad = map_.add_landmark({0, 0, 2}, a, 1);
  map_.find(good)->times_visible = 10;
  map_.find(good)->times_found = 8;
  map_.find(bad)->times_visible = 10;
  map_.find(bad)->times_found = 2;
  culler.watch({good, bad});
  EXPECT_EQ(culler.cull(map_, a), 1);
  EXPECT_NE(map_.find(good), nullptr);
  EXPECT_EQ(map_.find(bad), nullptr);
}

}  // namespace
}  // namespace roslam
