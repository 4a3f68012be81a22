// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// How far measured points are trusted.
struct MeasurementNoise {
  double pixel_sigma = 1.5;    ///< pixels at the finest pyramid level; grows with the level's scale
  double depth_sigma = 0.005;  ///< metres, the part that does not depend on distance
  double depth_sigma_growth =
      0.004;  ///< 1/metre: depth noise grows with the square of the distance (Khoshelham 2012)

  /// What fits worse than the chi-squared limit weighs less; what fits worse than so many times the limit is
  /// wrong. Dropping measurements at the limit itself would keep landmarks where they are instead of letting
  /// bundle adjustment move them.
  double outlier_factor = 4.0;

  double sigma_of_depth(double depth) const { return depth_sigma + depth_sigma_growth * depth * depth; }

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// A point of the world as one image shows it.
struct Measurement {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< lens distortion removed
  double depth = 0.0;                               ///< metres along the optical axis, 0 = unknown
  double pixel_weight = 1.0;                        ///< 1 / sigma, 1/pixel
  double depth_weight = 0.0;                        ///< 1 / sigma of 1 / depth, metres; 0 = no depth
  double outlier_factor = 1.0;                      ///< times the chi-squared limit that make an outlier

  static Measurement make(const Eigen::Vector2f& pixel, float depth, float scale,
                          const MeasurementNoise& noise);
  bool has_depth() const { return depth_weight > 0.0; }
};

/// 95 % limits of the squared error of measurements without and with depth (chi-squared, 2 and 3 degrees of
/// freedom).
constexpr double kChiSquared2 = 5.991;
constexpr double kChiSquared3 = 7.815;
inline double chi_squared_limit(const Measurement& m) { return m.has_depth() ? kChiSquared3 : kChiSquared2; }

/// Squared error above which a measurement is an outlier rather than a bad fit (see MeasurementNoise).
inline double outlier_limit(const Measurement& m) { return m.outlier_factor * chi_squared_limit(m); }

/// The error of a measurement: (pixel x, pixel y, inverse depth), each divided by its sigma; the last row is
/// 0 where depth is unknown. All of it refers to the point's coordinates in the camera frame (z > 0). Depth
/// cameras measure disparity, whose noise does not depend on distance. Errors of depth itself, each weighed
/// by the sigma at what was measured, would trust what came out too near more than what came out too far and
/// shrink the world.
struct ReprojectionError {
  const Camera& camera;
  const Measurement& measurement;

  Eigen::Vector3d error(const Eigen::Vector3d& point_camera) const;

  /// Derivative of the error by the point in the camera frame.
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& point_camera) const;
};

}  // namespace roslam
