// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "roslam/geometry/camera.hpp"

namespace roslam {

/// How a stereo depth camera errs; the defaults are those of an Intel RealSense D455.
struct DepthNoiseOptions {
  double baseline = 0.095;        ///< between its two imagers, metres
  double disparity_sigma = 0.08;  ///< standard deviation of the disparity, pixels
  double min_depth = 0.4;         ///< metres; nearer is unknown
  double sure_depth = 10.0;       ///< metres; beyond, ever more of the depth is unknown
  double max_depth = 20.0;        ///< metres; farther is unknown
  double resolution = 0.001;      ///< metres

  /// Throws OptionsError naming the field that is out of its range.
  void validate() const;
};

/// What a stereo depth camera would measure of a true depth image (CV_32FC1, metres, 0 = nothing there):
/// noise that grows with the square of the range, holes beside what stands in front, at grazing angles and
/// far away. The same for the same image and seed.
cv::Mat stereo_depth(const cv::Mat& truth, const Camera& camera, const DepthNoiseOptions& options,
                     std::uint32_t seed);

}  // namespace roslam
