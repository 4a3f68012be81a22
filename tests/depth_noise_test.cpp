// SPDX-License-Identifier: BSD-3-Clause
// The noise of a depth camera, estimated from images of known pose and applied to what is measured.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "roslam/estimation/measurement_model.hpp"
#include "roslam/sensors/depth_noise_estimator.hpp"
#include "roslam/slam/camera_noise.hpp"

namespace roslam {
namespace {

Camera vga_camera() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 520.0;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

// A room seen from a moving camera: floor, far wall, and a side wall that comes near.
class DepthNoiseRoom : public testing::Test {
 protected:
  static constexpr double kInterval = 1.0 / 30.0;  // seconds

  static SE3 pose(int frame) {
    const double t = frame * kInterval;
    return SE3(Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * std::sin(t), Eigen::Vector3d::UnitY())),
               Eigen::Vector3d(0.2 * std::sin(2.0 * t), 0.05 * std::cos(t), 0.3 * t));
  }

  // CV_32FC1: distance to the nearest plane along each ray, with noise.
  cv::Mat depth(int frame, const DepthNoise& noise) {
    struct Plane {
      Eigen::Vector3d normal;
      double offset;  // normal . p = offset in the world
    };
    const std::array<Plane, 3> planes{
        {{{0, 1, 0}, 1.2}, {Eigen::Vector3d(0, 0, 1), 6.0}, {Eigen::Vector3d(1, 0, 0.4), 1.5}}};
    const SE3 T_world_camera = pose(frame).inverse();
    cv::Mat image = cv::Mat::zeros(camera_.height, camera_.width, CV_32FC1);
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const Eigen::Vector3d ray =
            T_world_camera.rotation() * camera_.unproject(camera_.undistort({x, y}), 1.0);
        double nearest = 100.0;
        for (const Plane& plane : planes) {
          const double along = plane.normal.dot(ray);
          const double z = (plane.offset - plane.normal.dot(T_world_camera.translation())) / along;
          if (along > 1e-6 && z > 0.1) nearest = std::min(nearest, z);
        }
        image.at<float>(y, x) =
            nearest < 50.0 ? static_cast<float>(nearest + random_.gaussian(noise.sigma(nearest))) : 0.0F;
      }
    }
    return image;
  }

  std::optional<DepthNoise> estimate(const DepthNoise& noise, int frames = 40) {
    DepthNoiseEstimator estimator(camera_);
    for (int i = 0; i < frames; ++i) estimator.add(depth(i, noise), {}, pose(i), i * kInterval);
    return estimator.estimate();
  }

  Camera camera_ = vga_camera();
  cv::RNG random_{7};
};

TEST_F(DepthNoiseRoom, IsFoundWithinAFifthForGoodAndPoorCameras) {
  for (const DepthNoise truth :
       {DepthNoise{0.001, 0.0015}, DepthNoise{0.002, 0.006}, DepthNoise{0.0005, 0.012}}) {
    const auto found = estimate(truth);
    ASSERT_TRUE(found);
    for (const double z : {1.5, 3.0, 6.0})
      EXPECT_NEAR(found->sigma(z), truth.sigma(z), 0.2 * truth.sigma(z)) << truth.growth << " at " << z;
  }
}

TEST_F(DepthNoiseRoom, ThingsThatMoveDoNotMatter) {
  const DepthNoise truth{0.001, 0.003};
  DepthNoiseEstimator estimator(camera_);
  for (int i = 0; i < 40; ++i) {
    cv::Mat image = depth(i, truth);
    // A third of the image is taken up by something that comes nearer.
    image(cv::Rect(0, 0, image.cols / 3, image.rows)).setTo(2.0 - 0.03 * i);
    estimator.add(image, {}, pose(i), i * kInterval);
  }
  ASSERT_TRUE(estimator.estimate());
  EXPECT_NEAR(estimator.estimate()->sigma(4.0), truth.sigma(4.0), 0.3 * truth.sigma(4.0));
}

TEST_F(DepthNoiseRoom, LensDistortionIsTakenIntoAccount) {
  camera_.distortion = {0.2, -0.3, 0.001, -0.001, 0.0};
  const DepthNoise truth{0.001, 0.002};
  const auto found = estimate(truth);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->sigma(3.0), truth.sigma(3.0), 0.2 * truth.sigma(3.0));
}

TEST_F(DepthNoiseRoom, NothingIsSaidOfTooLittle) {
  const DepthNoise noise;
  EXPECT_FALSE(estimate(noise, 4));
  DepthNoiseEstimator estimator(camera_);
  for (int i = 0; i < 60; ++i) {
    estimator.add(depth(0, noise), {}, pose(0), i * kInterval);
    estimator.interrupt();  // each frame in a submap of its own
  }
  EXPECT_FALSE(estimator.estimate());
  const cv::Mat everything(camera_.height, camera_.width, CV_8UC1, cv::Scalar(255));
  for (int i = 0; i < 40; ++i) estimator.add(depth(i, noise), everything, pose(i), i * kInterval);
  EXPECT_FALSE(estimator.estimate());
  for (int i = 0; i < 40; ++i) estimator.add({}, {}, pose(i), i * kInterval);
  for (int i = 40; i > 0; --i) estimator.add(depth(i, noise), {}, pose(i), i * kInterval);
  EXPECT_FALSE(estimator.estimate()) << "a clock that runs backwards";
}

TEST_F(DepthNoiseRoom, EachRangeOfDistancesIsTold) {
  const DepthNoise truth{0.001, 0.004};
  DepthNoiseEstimator estimator(camera_);
  for (int i = 0; i < 60; ++i) estimator.add(depth(i, truth), {}, pose(i), i * kInterval);
  const auto bands = estimator.bands();
  ASSERT_GE(bands.size(), 3U);
  for (const auto& band : bands)
    EXPECT_NEAR(band.sigma, truth.sigma(band.depth), 0.3 * truth.sigma(band.depth)) << band.depth;
}

class NoiseOfACamera : public DepthNoiseRoom {
 protected:
  // Frames whose features are off by so many times what is assumed.
  void track(CameraNoise& noise, double pixel_sigma, const DepthNoise& depth_noise, int frames) {
    for (int i = 0; i < frames; ++i) {
      TrackedFrame frame;
      frame.state = TrackingState::kTracking;
      frame.timestamp = i * kInterval;
      frame.T_camera_world = pose(i);
      frame.inliers = 200;
      frame.pixel_error_scale = pixel_sigma / noise.of_features().pixel_sigma;
      noise.add(frame, depth(i, depth_noise), {});
    }
  }
};

TEST_F(NoiseOfACamera, ComesToWhatTheImagesShow) {
  CameraNoise noise(camera_, {});
  EXPECT_EQ(noise.of_features().pixel_sigma, MeasurementNoise{}.pixel_sigma);
  EXPECT_EQ(noise.of_features().depth_noise(), MeasurementNoise{}.depth_noise());
  const DepthNoise truth{0.001, 0.0015};
  track(noise, 0.8, truth, 100);
  EXPECT_NEAR(noise.of_features().pixel_sigma, 0.8, 0.05);
  EXPECT_LT(noise.of_features().sigma_of_depth(3.0), 2.2 * truth.sigma(3.0));
  EXPECT_GT(noise.of_features().sigma_of_depth(3.0), truth.sigma(3.0)) << "depth is poorer at features";
  ObservedFrame view;
  noise.note_in(view);
  EXPECT_EQ(view.pixel_sigma, noise.of_features().pixel_sigma);
  EXPECT_EQ(view.depth_noise, noise.of_features().depth_noise());
}

TEST_F(NoiseOfACamera, IsThatOfItsCalibrationUntilImagesShowIt) {
  camera_.depth_noise = DepthNoise{0.001, 0.009};
  CameraNoise noise(camera_, {});
  EXPECT_EQ(noise.depth(), camera_.depth_noise);
  track(noise, 1.5, {0.001, 0.002}, 40);
  EXPECT_LT(noise.depth()->growth, 0.004);
}

TEST_F(NoiseOfACamera, StaysWithinThreefoldOfWhatIsAssumed) {
  CameraNoise noise(camera_, {});
  track(noise, 100.0, {}, 200);
  EXPECT_DOUBLE_EQ(noise.of_features().pixel_sigma, 3.0 * MeasurementNoise{}.pixel_sigma);
}

TEST_F(NoiseOfACamera, IsWhatTheOptionsSayWhereItIsNotToBeEstimated) {
  MeasurementNoise fixed;
  fixed.estimate = false;
  fixed.pixel_sigma = 1.1;
  camera_.depth_noise = DepthNoise{0.001, 0.009};
  CameraNoise noise(camera_, fixed);
  track(noise, 3.0, {0.01, 0.02}, 60);
  EXPECT_EQ(noise.of_features().pixel_sigma, 1.1);
  EXPECT_EQ(noise.of_features().depth_noise(), fixed.depth_noise());
  EXPECT_FALSE(noise.depth());
}

TEST(KnownNoise, ReplacesWhatIsAssumedPartByPart) {
  const MeasurementNoise assumed;
  const MeasurementNoise pixels = assumed.known_of(0.5, {});
  EXPECT_EQ(pixels.pixel_sigma, 0.5);
  EXPECT_EQ(pixels.depth_noise(), assumed.depth_noise());
  const MeasurementNoise depth = assumed.known_of({}, DepthNoise{0.1, 0.2});
  EXPECT_EQ(depth.pixel_sigma, assumed.pixel_sigma);
  EXPECT_DOUBLE_EQ(depth.sigma_of_depth(2.0), 0.9);
}

}  // namespace
}  // namespace roslam
