// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "roslam/geometry/camera.hpp"

namespace roslam::simulation {

/// Error model of a stereo depth camera; the defaults are those of an Intel RealSense D455.
struct DepthNoiseOptions {
  double baseline = 0.095;        ///< between its two imagers, metres
  double disparity_sigma = 0.08;  ///< standard deviation of the disparity, pixels
  double min_depth = 0.4;         ///< metres; smaller depths are unknown
  double sure_depth = 10.0;       ///< metres; beyond it the share of unknown depth grows
  double max_depth = 20.0;        ///< metres; larger depths are unknown
  double resolution = 0.001;      ///< of the measured depth, metres

  /// Throws OptionsError naming the field that is out of its range.
  void validate() const;
};

/// The depth image that a stereo camera measures of a true one (both CV_32FC1, metres, 0 = unknown): noise
/// with a deviation proportional to the squared depth, holes at occlusions, at grazing angles and at long
/// range. Deterministic in image and seed. Throws OptionsError.
cv::Mat stereo_depth(const cv::Mat& truth, const Camera& camera, const DepthNoiseOptions& options,
                     std::uint32_t seed);

}  // namespace roslam::simulation
