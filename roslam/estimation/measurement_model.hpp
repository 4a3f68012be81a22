// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "roslam/common/export.hpp"
#include "roslam/estimation/estimation_options.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// Observation of a point in one image.
struct ROSLAM_EXPORT Measurement {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();  ///< lens distortion removed
  double depth = 0.0;                               ///< metres along the optical axis, 0 = unknown
  double pixel_weight = 1.0;                        ///< 1 / sigma, 1/pixel
  double depth_weight = 0.0;                        ///< 1 / sigma of 1 / depth, metres; 0 = no depth
  double outlier_factor = 1.0;                      ///< multiple of the limit, see MeasurementNoise

  /// inverse_depth_sigma: 1/metre, of this depth where it is known better than by the noise; 0: it is not.
  static Measurement make(const Eigen::Vector2f& pixel, float depth, float scale,
                          const MeasurementNoise& noise, double inverse_depth_sigma = 0.0);
  bool has_depth() const { return depth_weight > 0.0; }
};

/// 95 % limits of the squared error of measurements without and with depth (chi-squared, 2 and 3 degrees of
/// freedom).
constexpr double kChiSquared2 = 5.991;
constexpr double kChiSquared3 = 7.815;
inline double chi_squared_limit(const Measurement& m) { return m.has_depth() ? kChiSquared3 : kChiSquared2; }

/// Squared error above which a measurement is an outlier (see MeasurementNoise::outlier_factor).
inline double outlier_limit(const Measurement& m) { return m.outlier_factor * chi_squared_limit(m); }

/// The error of a measurement: (pixel x, pixel y, inverse depth), each divided by its sigma; the last row is
/// 0 where depth is unknown. Points are given in the camera frame (z > 0). Inverse depth, because depth
/// cameras measure disparity, whose noise does not depend on distance. Errors of depth itself, weighted by
/// the sigma at the measured depth, would give readings that are too near more weight than those too far and
/// shrink the map.
struct ROSLAM_EXPORT ReprojectionError {
  const Camera& camera;
  const Measurement& measurement;

  Eigen::Vector3d error(const Eigen::Vector3d& point_camera) const;

  /// Derivative of the error with respect to the point in the camera frame.
  Eigen::Matrix3d jacobian(const Eigen::Vector3d& point_camera) const;
};

}  // namespace roslam
