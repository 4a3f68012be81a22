// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/features/descriptor.hpp"
#include "roslam/features/feature_grid.hpp"
#include "roslam/features/feature_options.hpp"
#include "roslam/features/orb_extractor.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/depth_noise.hpp"

namespace roslam {

/// Features of one image as tracking and mapping use them, without the image itself. All arrays have one
/// entry per point and are ordered by pyramid level.
struct ROSLAM_EXPORT ObservedFrame {
  std::vector<Eigen::Vector2f> pixels;      ///< lens distortion removed
  std::vector<float> depths;                ///< metres along the optical axis, 0 = unknown
  std::vector<float> inverse_depth_sigmas;  ///< 1/metre, of stereo; empty: as the depth noise says
  std::vector<std::uint8_t> levels;         ///< pyramid level
  std::vector<float> angles;                ///< degrees
  std::vector<cv::Vec3b> colours;           ///< BGR
  std::vector<Descriptor> descriptors;
  std::vector<bool>
      is_movable;    ///< on a movable object at rest: used for the pose, never mapped; empty = none
  FeatureGrid grid;  ///< over pixels

  // Noise as known when the image was taken; where unset it is as the options say.
  std::optional<double> pixel_sigma;  ///< at the finest level
  std::optional<DepthNoise> depth_noise;

  std::size_t size() const { return pixels.size(); }
  bool may_move(std::size_t point) const { return point < is_movable.size() && is_movable[point]; }

  /// Of a depth that stereo measured, 1/metre; 0: as the depth noise says.
  float inverse_depth_sigma(std::size_t point) const {
    return inverse_depth_sigmas.empty() ? 0.0F : inverse_depth_sigmas[point];
  }

  /// Whether the depth is known, and where stereo measured it, to that share of it.
  bool has_depth(std::size_t point, float most_relative_sigma) const {
    return depths[point] > 0.0F && inverse_depth_sigma(point) * depths[point] <= most_relative_sigma;
  }

  /// Standard deviation of a known depth over the depth. otherwise: the noise where the frame does not say.
  double relative_depth_sigma(std::size_t point, const DepthNoise& otherwise) const {
    const double depth = depths[point];
    const double sigma = inverse_depth_sigma(point);
    return sigma > 0.0 ? sigma * depth : depth_noise.value_or(otherwise).sigma(depth) / depth;
  }
};

/// Depth at a pixel of a depth image (CV_32FC1, metres); 0 where it is unknown, out of the limits, or at a
/// depth discontinuity.
ROSLAM_EXPORT float depth_at(const cv::Mat& depth, const cv::Point2f& pixel, const DepthOptions& options);

/// Combines features with the depth image (CV_32FC1 metres, 0 or NaN = unknown, may be empty) and removes
/// lens distortion from their pixels. colour may be empty (points are grey then).
ROSLAM_EXPORT ObservedFrame observe(std::span<const OrbFeature> features, const cv::Mat& colour,
                                    const cv::Mat& depth, const Camera& camera, const DepthOptions& options);

}  // namespace roslam
