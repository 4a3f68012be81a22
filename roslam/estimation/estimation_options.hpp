// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <optional>

#include "roslam/common/export.hpp"
#include "roslam/geometry/depth_noise.hpp"

namespace roslam {

/// Noise model of measured points.
struct ROSLAM_EXPORT MeasurementNoise {
  double pixel_sigma = 1.5;    ///< pixels at the finest pyramid level; grows with the level's scale
  double depth_sigma = 0.005;  ///< metres, the part independent of distance
  double depth_sigma_growth =
      0.004;  ///< 1/metre: depth noise grows with the square of the distance (Khoshelham 2012)

  /// Squared errors above the chi-squared limit (95 %) are down-weighted (Huber); above this many times the
  /// limit they are outliers. A larger factor lets wrong matches support a wrong pose.
  double outlier_factor = 1.0;

  /// The noise is estimated while the pose is tracked; estimates, and the depth noise that the camera's
  /// calibration states, replace the values above.
  bool estimate = true;

  /// This model, with what is known of the noise of an image.
  MeasurementNoise known_of(const std::optional<double>& pixels,
                            const std::optional<DepthNoise>& depth) const;

  /// The larger of assumed and estimated depth noise: for tests whose tolerance has to cover errors of poses
  /// as well.
  DepthNoise at_least(const DepthNoise& estimated) const {
    return {std::max(depth_sigma, estimated.constant), std::max(depth_sigma_growth, estimated.growth)};
  }

  DepthNoise depth_noise() const { return {depth_sigma, depth_sigma_growth}; }
  double sigma_of_depth(double depth) const { return depth_noise().sigma(depth); }

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct ROSLAM_EXPORT PoseOptimiserOptions {
  int rounds = 4;      ///< each reclassifies inliers and outliers at its end
  int iterations = 8;  ///< Gauss-Newton (Levenberg-Marquardt where needed) steps per round, at most

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
