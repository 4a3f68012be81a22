// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "roslam/geometry/camera.hpp"

namespace roslam {

/// Distortion by the lens of a camera, of normalised coordinates: x/z, y/z of the camera frame. A view of the
/// camera's coefficients, which must outlive it.
///
/// A lens is valid up to the angle from its axis at which the radial polynomial stops to rise: beyond, it
/// folds the outer part of the scene back into the image. A fisheye is valid up to 80 degrees at most, since
/// undistorted pixels are those of a pinhole, which grow without limit towards 90 degrees.
class Lens {
 public:
  explicit Lens(const Camera& camera) : model_(camera.model), k_(camera.distortion) {}

  /// Largest angle from the axis at which fisheye lenses are used.
  static constexpr double kMaxFisheyeDegrees = 80.0;

  /// The formula of the model. Of use where is_valid(point).
  Eigen::Vector2d distort(const Eigen::Vector2d& point) const;

  /// Its derivative with respect to the point.
  Eigen::Matrix2d jacobian(const Eigen::Vector2d& point) const;

  /// Whether the lens is valid from its axis to this point.
  bool is_valid(const Eigen::Vector2d& point) const;

  /// The radius (of normalised coordinates) up to which the lens is valid; infinite where it does not end.
  double valid_radius() const;

  /// The valid point that is distorted to this one, to 1e-12; nothing if there is none.
  std::optional<Eigen::Vector2d> undistort(const Eigen::Vector2d& distorted) const;

  /// The point of the largest valid radius in the direction of a distorted point that has no valid one.
  Eigen::Vector2d outermost(const Eigen::Vector2d& distorted) const;

 private:
  bool is_rational() const { return k_[5] != 0.0 || k_[6] != 0.0 || k_[7] != 0.0; }
  Eigen::Vector2d start(const Eigen::Vector2d& distorted) const;
  std::optional<Eigen::Vector2d> iterate(Eigen::Vector2d point, const Eigen::Vector2d& distorted) const;
  std::optional<Eigen::Vector2d> search(const Eigen::Vector2d& distorted) const;
  double radial(double radius) const;

  LensModel model_;
  const std::array<double, 8>& k_;
};

}  // namespace roslam
