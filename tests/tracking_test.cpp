// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <random>

#include "roslam/common/error.hpp"
#include "roslam/estimation/measurement_model.hpp"
#include "roslam/estimation/pose_optimiser.hpp"
#include "roslam/matching/projection_matcher.hpp"

namespace roslam {
namespace {

constexpr double kDegree = 3.14159265358979 / 180.0;

TEST(ReprojectionError, JacobianAgreesWithNumericOne) {
  const Camera camera = *camera_preset("tum-fr1");
  const MeasurementNoise noise;
  for (const float depth : {0.0F, 2.2F}) {
    const Measurement measurement = Measurement::make({300.0F, 200.0F}, depth, 1.44F, noise);
    const ReprojectionError term{camera, measurement};
    const Eigen::Vector3d point(0.3, -0.2, 2.0);
    const Eigen::Matrix3d analytic = term.jacobian(point);
    constexpr double kStep = 1e-6;
    for (int c = 0; c < 3; ++c) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(c);
      const Eigen::Vector3d numeric = (term.error(point + step) - term.error(point - step)) / (2 * kStep);
      EXPECT_LT((analytic.col(c) - numeric).norm(), 1e-5 * (1.0 + numeric.norm())) << "column " << c;
    }
  }
}

TEST(ReprojectionError, IsZeroAtTheTruthAndOneSigmaOff) {
  const Camera camera;
  MeasurementNoise noise;
  noise.pixel_sigma = 2.0;
  const Eigen::Vector3d point(0.5, 0.25, 2.0);
  const Measurement exact = Measurement::make(camera.project(point).cast<float>(), 2.0F, 1.0F, noise);
  EXPECT_LT((ReprojectionError{camera, exact}.error(point)).norm(), 1e-4);
  const Measurement shifted =
      Measurement::make((camera.project(point) + Eigen::Vector2d(2.0, 0.0)).cast<float>(), 2.0F, 1.0F, noise);
  EXPECT_NEAR((ReprojectionError{camera, shifted}.error(point)).x(), -1.0, 1e-4);
}

// The best fit to many noisy depths must be unbiased: a bias would scale the map.
TEST(ReprojectionError, NoisyDisparitiesAverageToTheTrueDepth) {
  const Camera camera;
  const MeasurementNoise noise;
  constexpr double kTruth = 8.0;
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal(1.0 / kTruth, 0.03 / kTruth);
  std::vector<Measurement> measurements;
  for (int i = 0; i < 20000; ++i) {
    measurements.push_back(Measurement::make({0, 0}, static_cast<float>(1.0 / normal(random)), 1.0F, noise));
  }
  double depth = 7.0;
  for (int step = 0; step < 10; ++step) {
    double gradient = 0.0;
    double curvature = 0.0;
    for (const auto& measurement : measurements) {
      const ReprojectionError term{camera, measurement};
      const double j = term.jacobian({0, 0, depth})(2, 2);
      gradient += j * term.error({0, 0, depth}).z();
      curvature += j * j;
    }
    depth -= gradient / curvature;
  }
  EXPECT_NEAR(depth, kTruth, 0.001 * kTruth);
}

TEST(MeasurementNoise, DepthCountsLessFarAway) {
  const MeasurementNoise noise;
  const Camera camera;
  const auto error_of = [&](float measured, double true_depth) {
    const Measurement measurement = Measurement::make({0, 0}, measured, 1.0F, noise);
    return std::abs(ReprojectionError{camera, measurement}.error({0, 0, true_depth}).z());
  };
  EXPECT_GT(error_of(1.1F, 1.0), 3.0 * error_of(6.1F, 6.0));
  EXPECT_NEAR(error_of(4.0F, 4.0 + noise.sigma_of_depth(4.0)), 1.0, 0.05);
  EXPECT_FALSE(Measurement::make({0, 0}, 0.0F, 1.0F, noise).has_depth());
}

// Points in a box before the camera, seen from a known pose.
class PoseOptimiser : public testing::Test {
 protected:
  std::vector<PoseMeasurement> measure(int count, double pixel_noise, double outlier_share, bool with_depth) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::normal_distribution<double> normal;
    std::vector<PoseMeasurement> measurements;
    while (static_cast<int>(measurements.size()) < count) {
      const Eigen::Vector3d in_camera(2.0 * uniform(generator_), 1.5 * uniform(generator_),
                                      3.0 + 1.5 * uniform(generator_));
      Eigen::Vector2d pixel = camera_.project(in_camera);
      double depth = in_camera.z() + noise_.sigma_of_depth(in_camera.z()) * pixel_noise * normal(generator_);
      pixel += pixel_noise * Eigen::Vector2d(normal(generator_), normal(generator_));
      if (static_cast<double>(measurements.size()) < outlier_share * count) {
        pixel += Eigen::Vector2d(60.0 + 100.0 * uniform(generator_), 90.0 * uniform(generator_));
        depth += 0.8;
      }
      measurements.push_back(
          {truth_.inverse() * in_camera,
           Measurement::make(pixel.cast<float>(), with_depth ? static_cast<float>(depth) : 0.0F, 1.0F,
                             noise_)});
    }
    return measurements;
  }

  SE3 disturbed() const {
    Vector6d off;
    off << 0.05, -0.04, 0.06, 2 * kDegree, -1 * kDegree, 2 * kDegree;
    return SE3::exp(off) * truth_;
  }

  double translation_error(const SE3& pose) const { return (truth_ * pose.inverse()).translation().norm(); }
  double rotation_error(const SE3& pose) const { return (truth_ * pose.inverse()).angle(); }

  Camera camera_;
  MeasurementNoise noise_;
  std::mt19937 generator_{7};
  SE3 truth_ = SE3::exp((Vector6d() << 0.4, -1.0, 0.3, 0.2, -0.4, 0.1).finished());
};

TEST_F(PoseOptimiser, FindsTheTruthWithoutNoise) {
  for (const bool with_depth : {true, false}) {
    const auto pose = optimise_pose(camera_, measure(60, 0.0, 0.0, with_depth), disturbed());
    EXPECT_EQ(pose.inliers, 60);
    EXPECT_LT(translation_error(pose.T_camera_world), 1e-4);
    EXPECT_LT(rotation_error(pose.T_camera_world), 1e-4);
  }
}

TEST_F(PoseOptimiser, StaysNearTheTruthWithNoise) {
  const auto pose = optimise_pose(camera_, measure(300, 1.0, 0.0, true), disturbed());
  EXPECT_LT(translation_error(pose.T_camera_world), 0.005);
  EXPECT_LT(rotation_error(pose.T_camera_world), 0.1 * kDegree);
  EXPECT_GT(pose.inliers, 290);
}

TEST_F(PoseOptimiser, AMeasurementCountsByItsWeight) {
  auto measurements = measure(100, 0.0, 0.0, true);
  // A quarter of them are off by a little, in the same direction.
  for (std::size_t i = 0; i < measurements.size(); i += 4)
    measurements[i].measurement.pixel += Eigen::Vector2d(1.5, 0.0);
  const auto error_with = [&](double weight) {
    for (std::size_t i = 0; i < measurements.size(); i += 4) measurements[i].weight = weight;
    return rotation_error(optimise_pose(camera_, measurements, disturbed()).T_camera_world);
  };
  const double full = error_with(1.0);
  EXPECT_GT(full, 1e-4);
  EXPECT_LT(error_with(0.25), 0.5 * full);
  EXPECT_LT(error_with(0.0), 1e-5);
}

TEST_F(PoseOptimiser, SetsOutliersAside) {
  const auto measurements = measure(300, 1.0, 0.3, true);
  const auto pose = optimise_pose(camera_, measurements, disturbed());
  EXPECT_LT(translation_error(pose.T_camera_world), 0.006);
  int outliers_kept = 0;
  for (std::size_t i = 0; i < 90; ++i) outliers_kept += pose.is_inlier[i] ? 1 : 0;
  EXPECT_LE(outliers_kept, 1);
  EXPECT_GT(pose.inliers, 200);
}

TEST_F(PoseOptimiser, SaysSoWhenThereIsTooLittle) {
  const auto pose = optimise_pose(camera_, measure(2, 0.0, 0.0, true), disturbed());
  EXPECT_EQ(pose.inliers, 0);
  EXPECT_EQ(optimise_pose(camera_, {}, truth_).inliers, 0);
}

TEST_F(PoseOptimiser, PointsBehindTheCameraAreOutliers) {
  auto measurements = measure(50, 0.0, 0.0, true);
  for (std::size_t i = 0; i < 10; ++i) {
    const Eigen::Vector3d in_camera = truth_ * measurements[i].point_world;
    measurements[i].point_world =
        truth_.inverse() * Eigen::Vector3d(in_camera.x(), in_camera.y(), -in_camera.z());
  }
  const auto pose = optimise_pose(camera_, measurements, disturbed());
  for (std::size_t i = 0; i < 10; ++i) EXPECT_FALSE(pose.is_inlier[i]);
  EXPECT_EQ(pose.inliers, 40);
}

TEST(ConsistentRotation, KeepsTheMajority) {
  std::vector<float> turns(50, 12.0F);
  turns.push_back(130.0F);
  turns.push_back(-90.0F);
  const auto keep = consistent_rotation(turns);
  for (std::size_t i = 0; i < 50; ++i) EXPECT_TRUE(keep[i]);
  EXPECT_FALSE(keep[50]);
  EXPECT_FALSE(keep[51]);
  EXPECT_TRUE(consistent_rotation({}).empty());
}

TEST(ConsistentRotation, WrapsAround) {
  const auto keep = consistent_rotation({1.0F, 361.0F, -359.0F, 721.0F});
  for (const bool kept : keep) EXPECT_TRUE(kept);
}

class MatchDescriptors : public testing::Test {
 protected:
  MatchDescriptors() {
    std::mt19937_64 generator(9);
    for (int i = 0; i < 40; ++i)
      a_.descriptors.push_back({generator(), generator(), generator(), generator()});
    a_.pixels.resize(40);
    b_ = a_;
    std::reverse(b_.descriptors.begin(), b_.descriptors.end());
  }

  static Descriptor with_flipped(Descriptor descriptor, int bits) {
    descriptor[0] ^= (std::uint64_t{1} << bits) - 1;
    return descriptor;
  }

  using Pairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

  ObservedFrame a_;
  ObservedFrame b_;  // the same points in reverse order
};

TEST_F(MatchDescriptors, FindsEachPointAgain) {
  EXPECT_EQ(match_descriptors(a_, {3, 5, 39}, b_, {}), (Pairs{{39, 0}, {5, 34}, {3, 36}}));
}

TEST_F(MatchDescriptors, LeavesOutWhatIsAmbiguous) {
  // Two about equally good.
  b_.descriptors[39 - 3] = with_flipped(a_.descriptors[3], 10);
  b_.descriptors[0] = with_flipped(a_.descriptors[3], 11);
  EXPECT_EQ(match_descriptors(a_, {3, 5}, b_, {}), (Pairs{{5, 34}}));
  b_.descriptors[0] = with_flipped(a_.descriptors[3], 13);
  EXPECT_EQ(match_descriptors(a_, {3, 5}, b_, {}), (Pairs{{5, 34}, {3, 36}}));
}

TEST_F(MatchDescriptors, LeavesOutWhatIsThereTwice) {
  b_.descriptors[0] = b_.descriptors[39 - 3];  // two that fit exactly
  EXPECT_EQ(match_descriptors(a_, {3, 5}, b_, {}), (Pairs{{5, 34}}));
}

TEST_F(MatchDescriptors, MatchesEachPointOnce) {
  // Two points of a compete for one of b.
  a_.descriptors[3] = with_flipped(b_.descriptors[34], 20);
  a_.descriptors[5] = with_flipped(b_.descriptors[34], 10);
  ASSERT_EQ(match_descriptors(a_, {3}, b_, {}), (Pairs{{3, 34}}));
  ASSERT_EQ(match_descriptors(a_, {5}, b_, {}), (Pairs{{5, 34}}));
  EXPECT_EQ(match_descriptors(a_, {3, 5, 39}, b_, {}), (Pairs{{39, 0}, {5, 34}}));
  EXPECT_EQ(match_descriptors(a_, {39, 5, 3}, b_, {}), (Pairs{{39, 0}, {5, 34}}));
}

}  // namespace
}  // namespace roslam
