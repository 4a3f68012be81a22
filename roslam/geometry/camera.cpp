// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/camera.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
void require(bool condition, const std::string& message) {
  if (!condition) throw CalibrationError("camera calibration: " + message);
}

// True if distortion can be inverted in all but a few pixels, such as those of an extreme corner.
bool is_invertible(const Camera& camera) {
  constexpr int kSteps = 16;  // along each side of a grid over the image
  constexpr int kFewPoints = (kSteps + 1) * (kSteps + 1) / 10;
  constexpr double kTolerance = 0.5;  // pixels
  int failures = 0;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Eigen::Vector2d pixel((camera.width - 1.0) * i / kSteps, (camera.height - 1.0) * j / kSteps);
      const Eigen::Vector2d back = camera.distort(camera.undistort(pixel));
      if (!((back - pixel).norm() < kTolerance)) ++failures;
    }
  }
  return failures <= kFewPoints;
}

bool positive(double value) { return std::isfinite(value) && value > 0.0; }
}  // namespace

std::string_view usual_depth_units() {
  return "it is 1000 for depth in millimetres (RealSense, Azure Kinect, 7-Scenes) and 5000 for TUM RGB-D";
}

void Camera::validate() const {
  const std::string got = "; check the camera file or use a preset";
  require(width >= 32 && width <= 16384,
          "width must be 32 to 16384 pixels, got " + std::to_string(width) + got);
  require(height >= 32 && height <= 16384,
          "height must be 32 to 16384 pixels, got " + std::to_string(height) + got);
  require(positive(fx), "fx must be positive, got " + std::to_string(fx) + got);
  require(positive(fy), "fy must be positive, got " + std::to_string(fy) + got);
  require(fx / fy > 0.1 && fx / fy < 10.0, "fx and fy differ more than tenfold" + got);
  require(fx > 0.05 * width && fx < 100.0 * width, "fx is implausible for the image width" + got);
  // Outside the image it is that of a larger image.
  require(cx > 0.0 && cx < width, "cx must lie within the image, got " + std::to_string(cx) + got);
  require(cy > 0.0 && cy < height, "cy must lie within the image, got " + std::to_string(cy) + got);
  for (const double k : distortion) {
    require(std::isfinite(k) && std::abs(k) < 1000.0,
            "distortion must be five finite numbers k1 k2 p1 p2 k3" + got);
  }
  require(is_invertible(*this), "distortion cannot be inverted over the image" + got);
  require(depth_units_per_metre == 0.0 || positive(depth_units_per_metre),
          "depth_units_per_metre must be positive, got " + std::to_string(depth_units_per_metre) + "; " +
              std::string(usual_depth_units()));
  if (imu) imu->validate();
  constexpr double kFar = 10.0;  // metres; more is a wrong unit
  require(T_body_camera.is_finite() && T_body_camera.translation().norm() <= kFar,
          "T_body_camera must be a rigid transform of at most 10 m");
  if (depth_noise) {
    const auto [constant, growth] = *depth_noise;
    require(constant >= 0.0 && constant < 10.0 && growth >= 0.0 && growth < 10.0 && constant + growth > 0.0,
            "depth_noise must have constant (metres) and growth (1/metre) of 0 to 10, not both 0");
  }
  require(positive(fps) && fps <= 10000.0, "fps must be positive, got " + std::to_string(fps));
}

bool Camera::has_distortion() const {
  return std::any_of(distortion.begin(), distortion.end(), [](double k) { return k != 0.0; });
}

bool Camera::has_central_principal_point() const {
  constexpr double kOffCentre = 0.15;  // of the image's size
  return std::abs(cx / width - 0.5) <= kOffCentre && std::abs(cy / height - 0.5) <= kOffCentre;
}

Eigen::Vector2d Camera::distort(const Eigen::Vector2d& pixel) const {
  const auto& [k1, k2, p1, p2, k3] = distortion;
  const double x = (pixel.x() - cx) / fx;
  const double y = (pixel.y() - cy) / fy;
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
  const double yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
  return {fx * xd + cx, fy * yd + cy};
}

Eigen::Vector2d Camera::undistort(const Eigen::Vector2d& pixel) const {
  if (!has_distortion()) return pixel;
  // Newton's method on distort() with a numeric Jacobian; three to four steps reach 1e-6 pixels.
  constexpr double kStep = 1e-3;
  Eigen::Vector2d estimate = pixel;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector2d residual = distort(estimate) - pixel;
    if (residual.squaredNorm() < 1e-14) break;
    Eigen::Matrix2d jacobian;
    jacobian.col(0) =
        (distort(estimate + Eigen::Vector2d(kStep, 0)) - distort(estimate - Eigen::Vector2d(kStep, 0)));
    jacobian.col(1) =
        (distort(estimate + Eigen::Vector2d(0, kStep)) - distort(estimate - Eigen::Vector2d(0, kStep)));
    jacobian /= 2.0 * kStep;
    if (std::abs(jacobian.determinant()) < 1e-9) break;
    estimate -= jacobian.inverse() * residual;
  }
  return estimate.allFinite() ? estimate : pixel;
}

std::array<double, 4> Camera::undistorted_bounds() const {
  std::array<double, 4> bounds{1e9, 1e9, -1e9, -1e9};
  const auto include = [&](double x, double y) {
    const Eigen::Vector2d p = undistort({x, y});
    bounds = {std::min(bounds[0], p.x()), std::min(bounds[1], p.y()), std::max(bounds[2], p.x()),
              std::max(bounds[3], p.y())};
  };
  constexpr int kSteps = 16;  // along each border, since distortion bends it
  for (int i = 0; i <= kSteps; ++i) {
    const double x = (width - 1.0) * i / kSteps;
    const double y = (height - 1.0) * i / kSteps;
    include(x, 0.0);
    include(x, height - 1.0);
    include(0.0, y);
    include(width - 1.0, y);
  }
  return bounds;
}

}  // namespace roslam
