// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/features/orb_extractor.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/stereo/stereo_options.hpp"

namespace roslam {

/// Where a point of the left image is in the right one.
struct ROSLAM_EXPORT Disparity {
  float pixels = 0.0F;  ///< of the full-size image, to the left; below 0 only by noise
  float sigma = 0.0F;   ///< pixels, standard deviation
};

/// Finds features of the left image in the right image of a rectified pair, each on the pyramid level it was
/// found on. The patch around it is searched for along the row by zero-mean normalised cross-correlation,
/// which differences of exposure do not change; the best place must be distinct, and the patch found there
/// must lead back to the feature (left-right check). Gauss-Newton (Lucas and Kanade 1981, along the row, with
/// gain and bias) makes it sub-pixel, and its normal equation and residual give the uncertainty: a corner on
/// a vertical edge is certain, one on a horizontal edge is not. Added to it is disparity_sigma, at the scale
/// of the level as for positions of features: errors of calibration and shutters, which the fit does not see.
/// Safe to use from several threads.
class ROSLAM_EXPORT StereoMatcher {
 public:
  /// camera: of the rectified pair. Throws CalibrationError if it has no baseline, OptionsError.
  StereoMatcher(const Camera& camera, const StereoOptions& options);

  /// left, right: pyramids of the same sizes, CV_8UC1, finest first. One entry a feature; nothing where it
  /// was not found.
  std::vector<std::optional<Disparity>> match(std::span<const OrbFeature> features,
                                              const std::vector<cv::Mat>& left,
                                              const std::vector<cv::Mat>& right) const;

  /// Sets depths and inverse_depth_sigmas of a view whose points are those features.
  void set_depths(const std::vector<std::optional<Disparity>>& disparities, ObservedFrame& view) const;

 private:
  double focal_baseline_;  // pixels * metres
  StereoOptions options_;
};

}  // namespace roslam
