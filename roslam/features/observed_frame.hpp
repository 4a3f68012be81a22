// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "roslam/features/descriptor.hpp"
#include "roslam/features/feature_grid.hpp"
#include "roslam/features/orb_extractor.hpp"
#include "roslam/geometry/camera.hpp"

namespace roslam {

/// What tracking and mapping know of one picture: its points, without the picture. All arrays have one entry
/// a point and are ordered by pyramid level.
struct ObservedFrame {
  std::vector<Eigen::Vector2f> pixels;  ///< lens distortion removed
  std::vector<float> depths;            ///< metres along the optical axis, 0 = unknown
  std::vector<std::uint8_t> levels;     ///< pyramid level
  std::vector<float> angles;            ///< degrees
  std::vector<cv::Vec3b> colours;       ///< BGR
  std::vector<Descriptor> descriptors;
  std::vector<bool>
      is_movable;  ///< on a thing that could move but rests: helps with the pose, never mapped; empty = none
  FeatureGrid grid;  ///< over pixels

  std::size_t size() const { return pixels.size(); }
  bool may_move(std::size_t point) const { return point < is_movable.size() && is_movable[point]; }
};

/// Depth limits of what is believed.
struct DepthOptions {
  double min_depth = 0.1;     ///< metres, nearer readings are unknown
  double max_depth = 20.0;    ///< metres, farther readings are unknown
  double edge_ratio = 0.05;   ///< depth is unknown where its neighbours differ by more than this share of it
  double edge_growth = 0.01;  ///< 1/metre, added to that share for each metre, as noise grows with distance
                              ///< and must not be taken for an edge

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Depth at a pixel of a depth image (CV_32FC1, metres); 0 where it is unknown, out of the limits, or where
/// foreground and background meet.
float depth_at(const cv::Mat& depth, const cv::Point2f& pixel, const DepthOptions& options);

/// Joins features with the depth image (CV_32FC1 metres, 0 or NaN = unknown, may be empty) and removes lens
/// distortion from their pixels. colour may be empty (points are grey then).
ObservedFrame observe(std::span<const OrbFeature> features, const cv::Mat& colour, const cv::Mat& depth,
                      const Camera& camera, const DepthOptions& options);

}  // namespace roslam
