// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/camera.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/geometry/lens.hpp"

namespace roslam {

namespace {
void require(bool condition, const std::string& message) {
  if (!condition) throw CalibrationError("camera calibration: " + message);
}

// True if distortion can be inverted in all but a few pixels, such as those of an extreme corner. The image
// of a fisheye may be a circle that fills a third of it.
bool is_invertible(const Camera& camera) {
  constexpr int kSteps = 16;  // along each side of a grid over the image
  constexpr int kPoints = (kSteps + 1) * (kSteps + 1);
  const int few = camera.model == LensModel::kFisheye ? kPoints * 2 / 3 : kPoints / 10;
  int failures = 0;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      const Eigen::Vector2d pixel((camera.width - 1.0) * i / kSteps, (camera.height - 1.0) * j / kSteps);
      if (!camera.try_undistort(pixel)) ++failures;
    }
  }
  return failures <= few;
}

// Of undistorted pixels, as tables and grids cover them.
bool has_bounded_image(const Camera& camera) {
  constexpr double kLargest = 16.0;
  const auto [left, top, right, bottom] = camera.undistorted_bounds();
  return right - left <= kLargest * camera.width && bottom - top <= kLargest * camera.height;
}

// Newton's method with a numeric Jacobian, as earlier versions have it for the five coefficients: recorded
// results depend on its last bits. Nothing where it does not converge.
std::optional<Eigen::Vector2d> invert_five_coefficients(const Camera& camera, const Eigen::Vector2d& pixel) {
  constexpr double kStep = 1e-3;
  const Lens lens(camera);
  const auto normalised = [&](const Eigen::Vector2d& at) {
    return Eigen::Vector2d((at.x() - camera.cx) / camera.fx, (at.y() - camera.cy) / camera.fy);
  };
  const auto distort = [&](const Eigen::Vector2d& at) {
    const Eigen::Vector2d distorted = lens.distort(normalised(at));
    return Eigen::Vector2d(camera.fx * distorted.x() + camera.cx, camera.fy * distorted.y() + camera.cy);
  };
  Eigen::Vector2d estimate = pixel;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector2d residual = distort(estimate) - pixel;
    if (residual.squaredNorm() < 1e-14)
      return lens.is_valid(normalised(estimate)) ? std::make_optional(estimate) : std::nullopt;
    Eigen::Matrix2d jacobian;
    jacobian.col(0) =
        (distort(estimate + Eigen::Vector2d(kStep, 0)) - distort(estimate - Eigen::Vector2d(kStep, 0)));
    jacobian.col(1) =
        (distort(estimate + Eigen::Vector2d(0, kStep)) - distort(estimate - Eigen::Vector2d(0, kStep)));
    jacobian /= 2.0 * kStep;
    if (std::abs(jacobian.determinant()) < 1e-9) break;
    estimate -= jacobian.inverse() * residual;
  }
  return std::nullopt;
}

bool positive(double value) { return std::isfinite(value) && value > 0.0; }
}  // namespace

std::string_view lens_model_name(LensModel model) {
  return model == LensModel::kFisheye ? "fisheye" : "pinhole";
}

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
  require(!(fy < 0.0),
          "fy is negative, got " + std::to_string(fy) +
              ": in the convention of that calibration the rows of the images are upside down; give fy "
              "without its sign, cy as counted from the top row, and check the images");
  require(positive(fy), "fy must be positive, got " + std::to_string(fy) + got);
  require(fx / fy > 0.1 && fx / fy < 10.0, "fx and fy differ more than tenfold" + got);
  require(fx > 0.05 * width && fx < 100.0 * width, "fx is implausible for the image width" + got);
  // Outside the image it is that of a larger image.
  require(cx > 0.0 && cx < width, "cx must lie within the image, got " + std::to_string(cx) + got);
  require(cy > 0.0 && cy < height, "cy must lie within the image, got " + std::to_string(cy) + got);
  for (const double k : distortion) {
    require(std::isfinite(k) && std::abs(k) < 1000.0,
            "distortion must be finite numbers, " +
                std::string(model == LensModel::kFisheye ? "k1 k2 k3 k4" : "k1 k2 p1 p2 k3 [k4 k5 k6]") +
                got);
  }
  require(model == LensModel::kPinhole ||
              std::all_of(distortion.begin() + 4, distortion.end(), [](double k) { return k == 0.0; }),
          "distortion of a fisheye has four numbers k1 k2 k3 k4" + got);
  require(is_invertible(*this), "distortion cannot be inverted over the image" + got);
  require(has_bounded_image(*this), "distortion spreads the image over more than 16 times its size" + got);
  require(depth_units_per_metre == 0.0 || positive(depth_units_per_metre),
          "depth_units_per_metre must be positive, got " + std::to_string(depth_units_per_metre) + "; " +
              std::string(usual_depth_units()));
  if (imu) imu->validate();
  constexpr double kFar = 10.0;  // metres; more is a wrong unit
  require(T_body_camera.is_finite() && T_body_camera.translation().norm() <= kFar,
          "T_body_camera must be a rigid transform of at most 10 m");
  require(baseline == 0.0 || (baseline >= 1e-3 && baseline <= kFar),
          "baseline must be 0 (no stereo pair) or 0.001 to 10 metres, got " + std::to_string(baseline));
  require(baseline == 0.0 || !has_distortion(),
          "a camera with a baseline is of rectified images; it has no distortion");
  if (depth_noise) {
    const auto [constant, growth] = *depth_noise;
    require(constant >= 0.0 && constant < 10.0 && growth >= 0.0 && growth < 10.0 && constant + growth > 0.0,
            "depth_noise must have constant (metres) and growth (1/metre) of 0 to 10, not both 0");
  }
  require(positive(fps) && fps <= 10000.0, "fps must be positive, got " + std::to_string(fps));
}

bool Camera::has_distortion() const {
  return model == LensModel::kFisheye ||
         std::any_of(distortion.begin(), distortion.end(), [](double k) { return k != 0.0; });
}

void Camera::set_lens(std::string_view model_name, const std::vector<double>& coefficients) {
  const bool is_fisheye = model_name == lens_model_name(LensModel::kFisheye);
  if (!is_fisheye && model_name != lens_model_name(LensModel::kPinhole))
    throw InputError("camera model '" + std::string(model_name) +
                     "' is not supported; use pinhole or fisheye");
  const std::size_t n = coefficients.size();
  // Three could be k1 k2 p1 as well as k1 k2 k3.
  const bool is_known = is_fisheye ? n == 4 : n == 0 || n == 2 || n == 4 || n == 5 || n == 8;
  if (!is_known) {
    throw InputError("distortion has " + std::to_string(n) + " values; give " +
                     (is_fisheye ? "k1 k2 k3 k4 of a fisheye" : "k1 k2 p1 p2 k3, or these and k4 k5 k6") +
                     ", with 0 for those that are not known");
  }
  model = is_fisheye ? LensModel::kFisheye : LensModel::kPinhole;
  distortion = {};
  std::copy(coefficients.begin(), coefficients.end(), distortion.begin());
}

bool Camera::is_rational() const {
  return model == LensModel::kPinhole &&
         std::any_of(distortion.begin() + 5, distortion.end(), [](double k) { return k != 0.0; });
}

std::vector<double> Camera::coefficients() const {
  const std::ptrdiff_t count = model == LensModel::kFisheye ? 4 : is_rational() ? 8 : 5;
  return {distortion.begin(), distortion.begin() + count};
}

bool Camera::has_central_principal_point() const {
  constexpr double kOffCentre = 0.15;  // of the image's size
  return std::abs(cx / width - 0.5) <= kOffCentre && std::abs(cy / height - 0.5) <= kOffCentre;
}

Eigen::Vector2d Camera::distort(const Eigen::Vector2d& pixel) const {
  const Lens lens(*this);
  const Eigen::Vector2d point((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  if (!lens.is_valid(point)) {
    const Eigen::Vector2d direction(fx * point.x(), fy * point.y());
    return Eigen::Vector2d(cx, cy) + 2.0 * (width + height) * direction.stableNormalized();
  }
  const Eigen::Vector2d distorted = lens.distort(point);
  return {fx * distorted.x() + cx, fy * distorted.y() + cy};
}

Eigen::Matrix2d Camera::distort_jacobian(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d point((pixel.x() - cx) / fx, (pixel.y() - cy) / fy);
  const Eigen::Vector2d focal(fx, fy);
  return focal.asDiagonal() * Lens(*this).jacobian(point) * focal.cwiseInverse().asDiagonal();
}

Eigen::Vector2d Camera::undistort(const Eigen::Vector2d& pixel) const {
  if (const auto undistorted = try_undistort(pixel)) return *undistorted;
  const Eigen::Vector2d outermost = Lens(*this).outermost({(pixel.x() - cx) / fx, (pixel.y() - cy) / fy});
  return {fx * outermost.x() + cx, fy * outermost.y() + cy};
}

std::optional<Eigen::Vector2d> Camera::try_undistort(const Eigen::Vector2d& pixel) const {
  if (!has_distortion()) return pixel;
  if (model == LensModel::kPinhole && !is_rational()) {
    if (const auto found = invert_five_coefficients(*this, pixel)) return found;
  }
  const auto point = Lens(*this).undistort({(pixel.x() - cx) / fx, (pixel.y() - cy) / fy});
  if (!point) return std::nullopt;
  return Eigen::Vector2d(fx * point->x() + cx, fy * point->y() + cy);
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
