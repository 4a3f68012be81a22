// SPDX-License-Identifier: BSD-3-Clause
// Lens models: against OpenCV, their inverse, their derivative, and where they end.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <random>

#include "roslam/common/error.hpp"
#include "roslam/features/feature_grid.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/pixel_rays.hpp"

namespace roslam {
namespace {

Camera with_lens(int width, int height, const std::array<double, 4>& intrinsics, const char* model,
                 const std::vector<double>& coefficients) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = intrinsics[0];
  camera.fy = intrinsics[1];
  camera.cx = intrinsics[2];
  camera.cy = intrinsics[3];
  camera.set_lens(model, coefficients);
  return camera;
}

struct NamedCamera {
  const char* name;
  Camera camera;
  double largest_angle = 80.0;  // degrees; that the image shows, or 80
};

// Lenses as calibrations of real cameras have them.
std::vector<NamedCamera> lenses() {
  return {
      {"none", with_lens(640, 480, {385, 385, 320, 240}, "pinhole", {})},
      {"Kinect", *camera_preset("tum-fr1")},
      {"Xtion", *camera_preset("bonn")},
      {"EuRoC", with_lens(752, 480, {458.654, 457.296, 367.215, 248.375}, "pinhole",
                          {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05})},
      {"D455", with_lens(640, 480, {385, 384, 321, 243}, "pinhole",
                         {-0.0565363, 0.0682019, 0.000366, 0.000693, -0.0218432})},
      {"barrel", with_lens(640, 480, {350, 350, 330, 230}, "pinhole", {-0.31, 0.12, 0.001, -0.002, -0.005})},
      {"Azure Kinect", with_lens(1280, 720, {605.9, 605.7, 639.4, 365.9}, "pinhole",
                                 {0.4455, -2.4746, 0.00056, -0.00033, 1.4709, 0.3276, -2.3073, 1.3997})},
      {"rational wide", with_lens(1280, 800, {560, 562, 645, 398}, "pinhole",
                                  {2.1, 0.9, 0.0002, -0.0003, 0.04, 2.45, 1.6, 0.21})},
      {"TUM-VI", with_lens(512, 512, {190.97847715, 190.97330709, 254.93170605, 256.89744082}, "fisheye",
                           {0.00348238939225, 0.000715034845216, -0.00205323614187, 0.000202936735918})},
      {"fisheye 120",
       with_lens(848, 800, {286.2, 286.4, 424.9, 399.6}, "fisheye", {-0.0104, 0.0217, -0.0204, 0.0057})},
      {"equidistant", with_lens(640, 480, {220, 221, 322, 238}, "fisheye", {0, 0, 0, 0})},
  };
}

cv::Point2d opencv_pixel(const Camera& camera, const Eigen::Vector3d& point) {
  const cv::Matx33d K(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  const std::vector<cv::Point3d> points{{point.x(), point.y(), point.z()}};
  const cv::Vec3d none(0, 0, 0);
  std::vector<cv::Point2d> pixels;
  if (camera.model == LensModel::kFisheye)
    cv::fisheye::projectPoints(points, pixels, none, none, K, camera.coefficients());
  else
    cv::projectPoints(points, none, none, K, camera.coefficients(), pixels);
  return pixels[0];
}

TEST(CameraModel, DistortsAsOpenCv) {
  std::mt19937 generator(3);
  for (const auto& [name, camera, largest] : lenses()) {
    std::uniform_real_distribution<double> x(0, camera.width - 1), y(0, camera.height - 1);
    int compared = 0;
    for (int i = 0; i < 500; ++i) {
      const auto undistorted = camera.try_undistort({x(generator), y(generator)});
      if (!undistorted) continue;
      const cv::Point2d expected = opencv_pixel(camera, camera.unproject(*undistorted, 1.7));
      const Eigen::Vector2d found = camera.distort(*undistorted);
      ASSERT_LT(std::hypot(found.x() - expected.x, found.y() - expected.y), 1e-8) << name;
      ++compared;
    }
    EXPECT_GT(compared, 350) << name;
  }
}

TEST(CameraModel, FisheyeIsTheFormulaOfKannalaAndBrandt) {
  const Camera camera =
      with_lens(512, 512, {190, 200, 255, 257}, "fisheye", {0.0034, 0.00076, -0.0005, 0.0001});
  for (const double degrees : {0.0, 1e-6, 5.0, 40.0, 79.0}) {
    const double t = degrees * std::numbers::pi / 180.0;
    const double d = t + 0.0034 * std::pow(t, 3) + 0.00076 * std::pow(t, 5) - 0.0005 * std::pow(t, 7) +
                     0.0001 * std::pow(t, 9);
    const Eigen::Vector2d along_x = camera.distort({190 * std::tan(t) + 255, 257});
    EXPECT_NEAR(along_x.x(), 190 * d + 255, 1e-9) << degrees;
    EXPECT_NEAR(along_x.y(), 257, 1e-9);
    const Eigen::Vector2d along_y = camera.distort({255, 257 - 200 * std::tan(t)});
    EXPECT_NEAR(along_y.y(), 257 - 200 * d, 1e-9) << degrees;
  }
}

TEST(CameraModel, UndistortInvertsDistortOverTheWholeImage) {
  for (const auto& [name, camera, largest] : lenses()) {
    ASSERT_NO_THROW(camera.validate()) << name;
    const double radius = std::tan(79.9 * std::numbers::pi / 180.0);
    int inverted = 0, all = 0;
    for (int x = 0; x < camera.width; x += 7) {
      for (int y = 0; y < camera.height; y += 5) {
        ++all;
        const Eigen::Vector2d pixel(x, y);
        const auto undistorted = camera.try_undistort(pixel);
        if (!undistorted) continue;
        ++inverted;
        ASSERT_LT((camera.distort(*undistorted) - pixel).norm(), 1e-7) << name << " " << pixel.transpose();
        ASSERT_EQ(camera.undistort(pixel), *undistorted);
      }
    }
    if (camera.model == LensModel::kPinhole) {
      EXPECT_EQ(inverted, all) << name << ": all of the image is seen";
    }
    // The other way round: every ray that the lens covers comes back.
    for (double angle = 0.0; angle < 6.28; angle += 0.1) {
      for (double share = 0.0; share < 1.0; share += 0.05) {
        const double r = radius * share * share;
        const Eigen::Vector2d pixel(camera.fx * r * std::cos(angle) + camera.cx,
                                    camera.fy * r * std::sin(angle) + camera.cy);
        const Eigen::Vector2d raw = camera.distort(pixel);
        if (raw.x() < 0 || raw.y() < 0 || raw.x() > camera.width - 1 || raw.y() > camera.height - 1) continue;
        const auto back = camera.try_undistort(raw);
        ASSERT_TRUE(back) << name << " " << pixel.transpose();
        ASSERT_LT((camera.distort(*back) - raw).norm(), 1e-7) << name;
        ASSERT_LT((*back - pixel).norm(), 1e-5) << name << " " << pixel.transpose();
      }
    }
  }
}

#ifdef __x86_64__  // elsewhere, multiplication and addition may be one operation
TEST(CameraModel, FiveCoefficientsGiveTheBitsOfVersion010) {
  // Of fr1 and EuRoC, computed by that version.
  const Camera euroc = lenses()[3].camera;
  EXPECT_EQ(euroc.undistort({0, 0}), Eigen::Vector2d(-0x1.0f9fac049b65bp+7, -0x1.703d13414d4c6p+6));
  EXPECT_EQ(euroc.distort({0, 0}), Eigen::Vector2d(0x1.26da8a3980eccp+6, 0x1.8f7c36e580cf8p+5));
  std::uint64_t hash = 14695981039346656037ULL;  // FNV-1a of 64-bit words
  for (const Camera& camera : {*camera_preset("tum-fr1"), euroc}) {
    for (int x = 0; x < camera.width; x += 3) {
      for (int y = 0; y < camera.height; y += 5) {
        const Eigen::Vector2d undistorted = camera.undistort({x, y}), distorted = camera.distort({x, y});
        for (const double value : {undistorted.x(), undistorted.y(), distorted.x(), distorted.y()})
          hash = (hash ^ std::bit_cast<std::uint64_t>(value)) * 1099511628211ULL;
      }
    }
  }
  EXPECT_EQ(hash, 0x4aa027c379279e9eULL);
}
#endif

TEST(CameraModel, JacobianIsTheDerivative) {
  constexpr double kStep = 1e-3;  // pixels
  for (const auto& [name, camera, largest] : lenses()) {
    for (double x = 0; x < camera.width; x += 37) {
      for (double y = 0; y < camera.height; y += 41) {
        const auto at = camera.try_undistort({x, y});
        if (!at || !camera.try_undistort({x + 1, y}) || !camera.try_undistort({x, y + 1})) continue;
        if ((*at - Eigen::Vector2d(camera.cx, camera.cy)).norm() > 5.0 * camera.fx) continue;
        Eigen::Matrix2d numeric;
        for (int i = 0; i < 2; ++i) {
          const Eigen::Vector2d step = kStep * Eigen::Vector2d::Unit(i);
          numeric.col(i) = (camera.distort(*at + step) - camera.distort(*at - step)) / (2.0 * kStep);
        }
        ASSERT_LT((camera.distort_jacobian(*at) - numeric).norm(), 1e-7)
            << name << "\n"
            << camera.distort_jacobian(*at) << "\n\n"
            << numeric;
      }
    }
    // On the axis, where the formulas of a fisheye are quotients of zeros.
    const Eigen::Vector2d axis(camera.cx, camera.cy);
    EXPECT_LT((camera.distort_jacobian(axis) - Eigen::Matrix2d::Identity()).norm(), 1e-12) << name;
    EXPECT_LT((camera.distort(axis) - axis).norm(), 1e-12) << name;
  }
}

TEST(CameraModel, JacobianIsContinuousNearTheAxis) {
  const Camera camera = with_lens(512, 512, {190, 190, 256, 256}, "fisheye", {0.1, 0.2, 0.3, 0.4});
  // Radii on both sides of where the series begins.
  for (const double radius : {0.9e-4, 1.1e-4}) {
    const Eigen::Matrix2d J = camera.distort_jacobian({256 + 190 * radius, 256});
    const double along = 1.0 + 3.0 * (0.1 - 1.0 / 3.0) * radius * radius;
    const double across = 1.0 + (0.1 - 1.0 / 3.0) * radius * radius;
    EXPECT_NEAR(J(0, 0), along, 1e-8);
    EXPECT_NEAR(J(1, 1), across, 1e-8);
  }
}

// r (1 - 0.4 r^2) rises up to r^2 = 1 / 1.2 and is at most 0.6086 there.
class FoldingLens : public testing::Test {
 protected:
  const double fold_ = std::sqrt(1.0 / 1.2);
  const double largest_ = fold_ * (1.0 - 0.4 / 1.2);
  Camera camera_ = with_lens(640, 480, {500, 500, 320, 240}, "pinhole", {-0.4, 0.0});
};

TEST_F(FoldingLens, DoesNotMapThePartBeyondTheFoldIntoTheImage) {
  // The formula alone maps r = 1.5 to 0.15, within the image.
  for (const double r : {1.001 * fold_, 1.2, 1.5, 1.58, 2.0, 10.0, 1e3, 1e30, 1e200}) {
    for (const Eigen::Vector2d& direction : {Eigen::Vector2d(1, 0), Eigen::Vector2d(-0.6, 0.8)}) {
      const Eigen::Vector2d pixel = Eigen::Vector2d(320, 240) + 500 * r * direction;
      const Eigen::Vector2d raw = camera_.distort(pixel);
      ASSERT_TRUE(raw.allFinite()) << r;
      EXPECT_LT((raw - Eigen::Vector2d(320, 240) - 2.0 * (640 + 480) * direction).norm(), 1e-6) << r;
    }
  }
  EXPECT_LT((camera_.distort({320 + 500 * 0.999 * fold_, 240}).x() - 320) / 500, largest_);
}

TEST_F(FoldingLens, GivesTheOutermostPixelWhereThereIsNoInverse) {
  camera_.width = 800;  // shows more than the lens covers
  camera_.cx = 400;
  for (const double share : {1.0001, 1.1, 1.3, 5.0}) {
    const Eigen::Vector2d raw(400 + 500 * largest_ * share, 240);
    EXPECT_FALSE(camera_.try_undistort(raw)) << share;
    EXPECT_LT((camera_.undistort(raw) - Eigen::Vector2d(400 + 500 * fold_, 240)).norm(), 1e-3) << share;
  }
  for (const double share : {0.5, 0.9, 0.999, 0.99999}) {
    const Eigen::Vector2d raw(400 - 500 * largest_ * share, 240);
    const auto pixel = camera_.try_undistort(raw);
    ASSERT_TRUE(pixel) << share;
    EXPECT_LT((camera_.distort(*pixel) - raw).norm(), 1e-8) << share;
  }
  const auto bounds = camera_.undistorted_bounds();
  EXPECT_NEAR(bounds[2], 400 + 500 * fold_, 2.0);
  const PixelRays rays(camera_);
  EXPECT_TRUE(std::isnan(rays.row(240)[799][0]));
  EXPECT_FALSE(std::isnan(rays.row(240)[600][0]));
  EXPECT_FALSE(rays.pixel({1.5F, 0.0F, 1.0F}));
}

TEST_F(FoldingLens, IsRefusedWhereItLosesMuchOfTheImage) {
  EXPECT_THROW(camera_.validate(), CalibrationError) << "it covers 0.6 of the focal length of 0.8";
  camera_.fx = camera_.fy = 700.0;
  EXPECT_NO_THROW(camera_.validate());
  camera_.distortion[0] = -3.0;
  EXPECT_THROW(camera_.validate(), CalibrationError);
}

TEST(CameraModel, RationalLensEndsWhereItsDenominatorDoes) {
  // r / (1 - 0.5 r^2): a pole at r = 1.414, beyond which the formula is negative.
  const Camera camera = with_lens(640, 480, {500, 500, 320, 240}, "pinhole", {0, 0, 0, 0, 0, -0.5, 0, 0});
  EXPECT_NEAR(camera.distort({320 + 500 * 1.2, 240}).x(), 320 + 500 * 1.2 / 0.28, 1e-6);
  for (const double r : {1.42, 2.0, 5.0}) EXPECT_GT(camera.distort({320 + 500 * r, 240}).x(), 640) << r;
}

TEST(CameraModel, FisheyeEndsAt80Degrees) {
  // An image circle of 180 degrees within the image: 150 px of 640 x 480 are 90 degrees.
  const double f = 230.0 / (std::numbers::pi / 2.0);
  const Camera camera = with_lens(640, 480, {f, f, 320, 240}, "fisheye", {0, 0, 0, 0});
  EXPECT_NO_THROW(camera.validate());
  const auto raw_at = [&](double degrees) {
    return Eigen::Vector2d(320 + f * degrees * std::numbers::pi / 180.0, 240);
  };
  const double limit = f * std::tan(80.0 * std::numbers::pi / 180.0);
  ASSERT_TRUE(camera.try_undistort(raw_at(79.9)));
  EXPECT_NEAR(camera.undistort(raw_at(79.9)).x(), 320 + f * std::tan(79.9 * std::numbers::pi / 180.0), 1e-6);
  for (const double degrees : {80.1, 89.0, 90.0, 95.0, 120.0}) {
    EXPECT_FALSE(camera.try_undistort(raw_at(degrees))) << degrees;
    EXPECT_NEAR(camera.undistort(raw_at(degrees)).x(), 320 + limit, 1e-6) << degrees;
  }
  EXPECT_GT(camera.distort({320 + 1.01 * limit, 240}).x(), 640);
  const auto bounds = camera.undistorted_bounds();
  EXPECT_NEAR(bounds[0], 320 - limit, 0.02 * limit);
  EXPECT_NEAR(bounds[1], 240 - limit, 0.02 * limit);
  EXPECT_NEAR(bounds[2], 320 + limit, 0.02 * limit);
  EXPECT_NEAR(bounds[3], 240 + limit, 0.02 * limit);
}

TEST(CameraModel, NothingIsInfiniteWhateverTheLens) {
  std::mt19937 generator(7);
  std::normal_distribution<double> normal;
  int valid = 0;
  for (int i = 0; i < 2000; ++i) {
    const bool is_fisheye = i % 2 == 0;
    std::vector<double> k(is_fisheye ? 4 : 8);
    const double size = std::pow(10.0, normal(generator) - 1.0);
    for (double& value : k) value = size * normal(generator);
    const Camera camera = with_lens(640, 480, {300, 310, 330, 220}, is_fisheye ? "fisheye" : "pinhole", k);
    for (const Eigen::Vector2d& pixel :
         {Eigen::Vector2d(0, 0), Eigen::Vector2d(639, 479), Eigen::Vector2d(330, 220),
          Eigen::Vector2d(500, 30), Eigen::Vector2d(1e5, -1e7)}) {
      ASSERT_TRUE(camera.distort(pixel).allFinite());
      ASSERT_TRUE(camera.undistort(pixel).allFinite());
      const auto found = camera.try_undistort(pixel);
      if (!found) continue;
      ASSERT_LT((camera.distort(*found) - pixel).norm(), 1e-6 * (1.0 + pixel.norm()));
    }
    try {
      camera.validate();
      ++valid;
      const auto bounds = camera.undistorted_bounds();
      EXPECT_LE(bounds[2] - bounds[0], 16.0 * 640);
      EXPECT_LE(bounds[3] - bounds[1], 16.0 * 480);
      EXPECT_LT(bounds[0], bounds[2]);
    } catch (const CalibrationError&) {
    }
  }
  EXPECT_GT(valid, 200);
  EXPECT_LT(valid, 1900);
}

TEST(CameraModel, IsChecked) {
  Camera camera;
  EXPECT_THROW(camera.set_lens("omni", {}), InputError);
  EXPECT_THROW(camera.set_lens("fisheye", {0, 0, 0, 0, 0}), InputError);
  EXPECT_THROW(camera.set_lens("fisheye", {}), InputError);
  EXPECT_THROW(camera.set_lens("pinhole", {1, 2, 3}), InputError);
  EXPECT_THROW(camera.set_lens("pinhole", {1, 2, 3, 4, 5, 6}), InputError);
  EXPECT_FALSE(camera.has_distortion());
  camera.set_lens("pinhole", {0.1, 0.0});
  EXPECT_EQ(camera.coefficients(), (std::vector<double>{0.1, 0, 0, 0, 0}));
  EXPECT_TRUE(camera.has_distortion());
  camera.set_lens("pinhole", {0, 0, 0, 0, 0, 0, 0, 0.1});
  EXPECT_EQ(camera.coefficients().size(), 8U);
  camera.set_lens("fisheye", {0, 0, 0, 0});
  EXPECT_EQ(camera.coefficients().size(), 4U);
  EXPECT_TRUE(camera.has_distortion()) << "a fisheye is no pinhole, whatever its coefficients";
  camera.distortion[6] = 0.1;
  EXPECT_THROW(camera.validate(), CalibrationError) << "more coefficients than a fisheye has";
}

TEST(CameraModel, UpsideDownImagesAreNamed) {
  Camera camera = *camera_preset("7scenes");
  camera.fy = -480.0;
  try {
    camera.validate();
    FAIL() << "a negative fy was accepted";
  } catch (const CalibrationError& error) {
    EXPECT_NE(std::string(error.what()).find("upside down"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace roslam
