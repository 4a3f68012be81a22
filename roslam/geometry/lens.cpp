// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/lens.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace roslam {

namespace {
constexpr double kMaxFisheyeAngle = Lens::kMaxFisheyeDegrees * std::numbers::pi / 180.0;
constexpr double kTolerance = 1e-12;       // of normalised coordinates
constexpr double kNearAxis = 1e-4;         // radius below which series replace quotients of zeros
using Polynomial = std::array<double, 7>;  // by ascending power

double value_of(const Polynomial& polynomial, double s) {
  double value = 0.0;
  for (std::size_t i = polynomial.size(); i-- > 0;) value = polynomial[i] + s * value;
  return value;
}

// Whether a polynomial that is 1 at 0 is positive from 0 to s.
bool is_positive_up_to(double s, const Polynomial& polynomial) {
  Polynomial bound = polynomial;  // falls with s and is nowhere larger
  for (std::size_t i = 1; i < bound.size(); ++i) bound[i] = std::min(bound[i], 0.0);
  if (value_of(bound, s) > 0.0) return true;
  constexpr int kSteps = 32;
  for (int i = 1; i <= kSteps; ++i)
    if (!(value_of(polynomial, s * i / kSteps) > 0.0)) return false;
  return true;
}

// The smallest positive root, up to a value from which it is of no importance; infinite if there is none.
double first_root(const Polynomial& polynomial) {
  if (std::all_of(polynomial.begin(), polynomial.end(), [](double k) { return k >= 0.0; }))
    return std::numeric_limits<double>::infinity();
  constexpr int kSteps = 128;
  // s = u / (1 - u) maps [0, 1) to all of it.
  const auto is_positive = [&](double u) { return value_of(polynomial, u / (1.0 - u)) > 0.0; };
  for (int i = 1; i < kSteps; ++i) {
    double after = static_cast<double>(i) / kSteps;
    if (is_positive(after)) continue;
    double before = static_cast<double>(i - 1) / kSteps;
    for (int bisection = 0; bisection < 45; ++bisection) {
      const double middle = 0.5 * (before + after);
      (is_positive(middle) ? before : after) = middle;
    }
    return before / (1.0 - before);
  }
  return std::numeric_limits<double>::infinity();
}

// Factors of the radial polynomial and, of a rational model, its denominator, at s, with their derivatives.
struct Radial {
  double numerator, numerator_slope;
  double denominator, denominator_slope;
};

Radial radial_of(const std::array<double, 8>& k, double s) {
  return {1.0 + s * (k[0] + s * (k[1] + s * k[4])), k[0] + s * (2.0 * k[1] + s * 3.0 * k[4]),
          1.0 + s * (k[5] + s * (k[6] + s * k[7])), k[5] + s * (2.0 * k[6] + s * 3.0 * k[7])};
}

// The slope of the distorted radius over the radius has the sign of this polynomial of the squared radius.
Polynomial slope_of_pinhole(const std::array<double, 8>& k) {
  const std::array<double, 4> numerator{1.0, k[0], k[1], k[4]};
  const std::array<double, 4> denominator{1.0, k[5], k[6], k[7]};
  Polynomial slope{};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j)
      slope[i + j] +=
          (1.0 + 2.0 * static_cast<double>(i) - 2.0 * static_cast<double>(j)) * numerator[i] * denominator[j];
  return slope;
}

Polynomial denominator_of(const std::array<double, 8>& k) { return {1.0, k[5], k[6], k[7]}; }

// Slope of the distorted angle over the angle, a polynomial of the squared angle.
Polynomial slope_of_fisheye(const std::array<double, 8>& k) {
  return {1.0, 3.0 * k[0], 5.0 * k[1], 7.0 * k[2], 9.0 * k[3]};
}

double distorted_angle(const std::array<double, 8>& k, double angle) {
  const double s = angle * angle;
  return angle * (1.0 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))));
}
}  // namespace

Eigen::Vector2d Lens::distort(const Eigen::Vector2d& point) const {
  const double x = point.x();
  const double y = point.y();
  if (model_ == LensModel::kFisheye) {
    const double radius = std::hypot(x, y);
    return radius > 0.0 ? Eigen::Vector2d(distorted_angle(k_, std::atan(radius)) / radius * point) : point;
  }
  const auto& [k1, k2, p1, p2, k3, k4, k5, k6] = k_;
  const double r2 = x * x + y * y;
  double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
  if (is_rational()) radial /= 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6));
  const double xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
  const double yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
  return {xd, yd};
}

Eigen::Matrix2d Lens::jacobian(const Eigen::Vector2d& point) const {
  const double x = point.x();
  const double y = point.y();
  if (model_ == LensModel::kFisheye) {
    // distorted = scale(radius) point
    const double radius = point.norm();
    const double angle = std::atan(radius);
    double scale = 1.0, growth = 2.0 * (k_[0] - 1.0 / 3.0);  // growth: d scale / d radius / radius
    if (radius > kNearAxis) {
      scale = distorted_angle(k_, angle) / radius;
      const double slope = value_of(slope_of_fisheye(k_), angle * angle) / (1.0 + radius * radius);
      growth = (slope - scale) / (radius * radius);
    }
    return scale * Eigen::Matrix2d::Identity() + growth * point * point.transpose();
  }
  const double p1 = k_[2], p2 = k_[3];
  const Radial at = radial_of(k_, x * x + y * y);
  const double radial = at.numerator / at.denominator;
  const double slope = (at.numerator_slope - radial * at.denominator_slope) / at.denominator;
  const double mixed = 2.0 * (x * y * slope + p1 * x + p2 * y);
  Eigen::Matrix2d result;
  result << radial + 2.0 * (x * x * slope + p1 * y + 3.0 * p2 * x), mixed,  //
      mixed, radial + 2.0 * (y * y * slope + 3.0 * p1 * y + p2 * x);
  return result;
}

bool Lens::is_valid(const Eigen::Vector2d& point) const {
  if (model_ == LensModel::kFisheye) {
    const double angle = std::atan(point.stableNorm());
    return angle <= kMaxFisheyeAngle && is_positive_up_to(angle * angle, slope_of_fisheye(k_));
  }
  const double s = point.squaredNorm();
  constexpr double kFar = 1e12;  // its powers are finite
  if (!(s < kFar)) return false;
  if (!is_rational()) return is_positive_up_to(s, {1.0, 3.0 * k_[0], 5.0 * k_[1], 7.0 * k_[4]});
  return is_positive_up_to(s, denominator_of(k_)) && is_positive_up_to(s, slope_of_pinhole(k_));
}

double Lens::valid_radius() const {
  if (model_ == LensModel::kFisheye) {
    const Polynomial slope = slope_of_fisheye(k_);
    const bool is_whole = is_positive_up_to(kMaxFisheyeAngle * kMaxFisheyeAngle, slope);
    return std::tan(is_whole ? kMaxFisheyeAngle : std::min(kMaxFisheyeAngle, std::sqrt(first_root(slope))));
  }
  return std::sqrt(std::min(first_root(slope_of_pinhole(k_)), first_root(denominator_of(k_))));
}

double Lens::radial(double radius) const {
  if (model_ == LensModel::kFisheye) return distorted_angle(k_, std::atan(radius));
  const Radial at = radial_of(k_, radius * radius);
  return radius * at.numerator / at.denominator;
}

// Near the solution for all but extreme lenses, without a search.
Eigen::Vector2d Lens::start(const Eigen::Vector2d& distorted) const {
  const double radius = distorted.norm();
  if (model_ == LensModel::kPinhole || !(radius > kNearAxis)) return distorted;
  double angle = std::min(radius, kMaxFisheyeAngle);
  for (int i = 0; i < 4; ++i) {
    const double slope = value_of(slope_of_fisheye(k_), angle * angle);
    angle = std::clamp(angle - (distorted_angle(k_, angle) - radius) / slope, 0.0, kMaxFisheyeAngle);
  }
  return std::tan(angle) / radius * distorted;
}

// Newton's method.
std::optional<Eigen::Vector2d> Lens::iterate(Eigen::Vector2d point, const Eigen::Vector2d& distorted) const {
  constexpr int kSteps = 20;
  for (int i = 0; i < kSteps && point.allFinite(); ++i) {
    const Eigen::Vector2d residual = distort(point) - distorted;
    if (residual.squaredNorm() < kTolerance * kTolerance)
      return is_valid(point) ? std::make_optional(point) : std::nullopt;
    point -= jacobian(point).inverse() * residual;
  }
  return std::nullopt;
}

// Brackets the radius, so that it also converges where Newton's method leaves the valid part.
std::optional<Eigen::Vector2d> Lens::search(const Eigen::Vector2d& distorted) const {
  const double wanted = distorted.norm();
  double high = valid_radius();
  if (!std::isfinite(high)) {
    constexpr double kFar = 1e6;
    for (high = std::max(wanted, 1.0); high < kFar && radial(high) < wanted;) high *= 2.0;
  }
  constexpr double kTangentialShare = 1.1;  // at most
  if (!(wanted < kTangentialShare * radial(high))) return std::nullopt;
  double low = 0.0;
  for (int bisection = 0; bisection < 50; ++bisection) {
    const double middle = 0.5 * (low + high);
    (radial(middle) < wanted ? low : high) = middle;
  }
  return wanted > 0.0 ? iterate(low / wanted * distorted, distorted) : std::nullopt;
}

std::optional<Eigen::Vector2d> Lens::undistort(const Eigen::Vector2d& distorted) const {
  if (const auto found = iterate(start(distorted), distorted)) return found;
  return search(distorted);
}

Eigen::Vector2d Lens::outermost(const Eigen::Vector2d& distorted) const {
  const double radius = valid_radius();
  return std::isfinite(radius) ? Eigen::Vector2d(radius * distorted.stableNormalized()) : distorted;
}

}  // namespace roslam
