// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/pixel_distortion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "roslam/geometry/lens.hpp"

namespace roslam {
namespace {

struct Pixels {
  std::vector<float> x, y;
};

// All over what a camera sees and beyond it, and a number that is no multiple of a vector register.
Pixels pixels_of(const Camera& camera) {
  constexpr int kSteps = 51;
  const auto [left, top, right, bottom] = camera.undistorted_bounds();
  Pixels pixels;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const double across = -0.2 + 1.4 * i / (kSteps - 1), down = -0.2 + 1.4 * j / (kSteps - 1);
      pixels.x.push_back(static_cast<float>(left + across * (right - left)));
      pixels.y.push_back(static_cast<float>(top + down * (bottom - top)));
    }
  }
  return pixels;
}

// How many pixels of the raw image were compared.
int expect_agreement(const Camera& camera) {
  const Pixels from = pixels_of(camera);
  Pixels to = from;
  PixelDistortion{camera}(to.x.size(), to.x.data(), to.y.data());
  const double valid = Lens(camera).valid_radius();
  int compared = 0;
  for (std::size_t i = 0; i < from.x.size(); ++i) {
    const Eigen::Vector2d pixel(from.x[i], from.y[i]), expected = camera.distort(pixel);
    const double radius =
        std::hypot((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy);
    if (std::abs(radius - valid) < 1e-5) continue;
    if (radius > valid) {
      EXPECT_EQ(to.x[i], PixelDistortion::kFar) << pixel.transpose();
      EXPECT_EQ(to.y[i], PixelDistortion::kFar) << pixel.transpose();
      continue;
    }
    EXPECT_LT((Eigen::Vector2d(to.x[i], to.y[i]) - expected).norm(), 1e-3) << pixel.transpose();
    ++compared;
  }
  return compared;
}

Camera camera_of(const char* model, const std::vector<double>& coefficients) {
  Camera camera;
  camera.set_lens(model, coefficients);
  camera.validate();
  return camera;
}

TEST(PixelDistortion, IsThatOfTheCamera) {
  EXPECT_GT(expect_agreement(camera_of("pinhole", {-0.0565, 0.0682, 0.000366, 0.000693, -0.0218})), 2000);
  EXPECT_GT(expect_agreement(camera_of("pinhole", {0.26, -0.95, -0.0054, 0.0026, 1.16})), 1000);
  EXPECT_GT(expect_agreement(camera_of("pinhole", {0.5, -2.7, 0.0007, -0.0001, 1.6, 0.38, -2.5, 1.5})), 1000);
}

TEST(PixelDistortion, IsThatOfAFisheye) {
  Camera camera = camera_of("fisheye", {0.02, -0.004, 0.001, -0.0002});
  camera.fx = camera.fy = 200.0;
  camera.validate();
  EXPECT_GT(expect_agreement(camera), 1000);
}

TEST(PixelDistortion, LeavesTheAxisOfALensInItsPlace) {
  const Camera camera = camera_of("fisheye", {0.02, -0.004, 0.001, -0.0002});
  auto x = static_cast<float>(camera.cx), y = static_cast<float>(camera.cy);
  PixelDistortion{camera}(1, &x, &y);
  EXPECT_FLOAT_EQ(x, static_cast<float>(camera.cx));
  EXPECT_FLOAT_EQ(y, static_cast<float>(camera.cy));
}

TEST(PixelDistortion, PutsWhatTheLensDoesNotSeeFarOutside) {
  const Camera folding = camera_of("pinhole", {-0.2, 0.0});
  for (const float outside : {3000.0F, -1e6F, 1e6F, std::numeric_limits<float>::quiet_NaN()}) {
    float x = outside, y = 200.0F;
    PixelDistortion{folding}(1, &x, &y);
    EXPECT_EQ(x, PixelDistortion::kFar) << outside;
    EXPECT_EQ(y, PixelDistortion::kFar) << outside;
  }
  const Camera growing = camera_of("pinhole", {0.2, 0.1, 0.0, 0.0, 0.1});
  float x = 1e6F, y = -1e6F;
  PixelDistortion{growing}(1, &x, &y);
  EXPECT_EQ(x, PixelDistortion::kFar);
  EXPECT_EQ(y, -PixelDistortion::kFar);
}

}  // namespace
}  // namespace roslam
