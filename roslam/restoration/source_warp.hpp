// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/geometry/se3f.hpp"
#include "roslam/restoration/restoration_options.hpp"
#include "roslam/restoration/source_image.hpp"

namespace roslam {

/// A point of the target projected into a source image.
struct WarpedPoint {
  Eigen::Vector2f pixel;      ///< of the source image
  float depth = 0.0F;         ///< metres, of the point in the source camera frame
  float source_depth = 0.0F;  ///< metres, of the source at that pixel; 0 = unknown
  bool is_measured = false;   ///< source_depth is measured, not filled in
  bool is_static = false;     ///< the source shows the static scene at that pixel
};

/// The mapping from a target image to a source image that it is filled from.
class SourceWarp {
 public:
  /// rays: of the camera that took both images. rays and source must outlive the warp.
  SourceWarp(const PixelRays& rays, const SourceImage& source, const SE3& T_source_target, double target_time,
             const ReprojectionOptions& options);

  /// Projects a point of the target camera frame into the source. Nothing outside the source image.
  std::optional<WarpedPoint> project(const Eigen::Vector3f& point) const;

  /// Looks up what the source shows at the pixel of a point, which lies in the source image.
  void look_up(WarpedPoint& point) const {
    const int x = static_cast<int>(point.pixel.x() + 0.5F), y = static_cast<int>(point.pixel.y() + 0.5F);
    point.source_depth = source_->depth.ptr<float>(y)[x];
    point.is_measured = source_->is_measured.ptr<std::uint8_t>(y)[x] != 0;
    point.is_static = source_->is_static.ptr<std::uint8_t>(y)[x] != 0;
  }

  /// Depth difference up to which two readings are of one surface, metres.
  float tolerance(float depth) const { return (tolerance_ + growth_ * depth) * depth; }

  /// Whether the source shows the point itself.
  bool shows(const WarpedPoint& s) const {
    return s.is_static && s.source_depth > 0.0F && std::abs(s.source_depth - s.depth) <= tolerance(s.depth);
  }

  /// Whether the source measured a surface behind the point: the point is in free space.
  bool sees_through(const WarpedPoint& s) const {
    return s.is_static && s.is_measured && s.source_depth - s.depth > 2.0F * tolerance(s.source_depth);
  }

  /// Weight of the source's colour for a point (target camera frame), 0 to 1: decreases with the age, the
  /// angle between the viewing rays and the resolution lost by a larger distance.
  float weight(const Eigen::Vector3f& point, float depth_in_source) const;

  /// Bilinearly interpolated colour (BGR) at a pixel of the source, times the exposure gain to the target.
  cv::Vec3f colour(const Eigen::Vector2f& pixel) const;

  /// Estimates the exposure gain of each channel, the median ratio over pixels that both images show. free:
  /// CV_8UC1, nonzero where the target shows the static scene. The gain stays 1 with too few such pixels.
  void match_exposure(const PosedImage& target, const cv::Mat& free);

  float age() const { return age_; }  ///< seconds between target and source
  float age_weight() const { return age_weight_; }
  float angle_scale() const { return angle_scale_; }         ///< radians
  const Eigen::Vector3f& centre() const { return centre_; }  ///< of the source camera, in the target's frame
  const SE3f& source_from_target() const { return source_from_target_; }
  const SE3f& target_from_source() const { return target_from_source_; }
  const SourceImage& source() const { return *source_; }

 private:
  const PixelRays* rays_;
  const SourceImage* source_;
  SE3f source_from_target_;
  SE3f target_from_source_;
  Eigen::Vector3f centre_;  // of the source camera, in the target camera frame
  float tolerance_, growth_, angle_scale_, max_gain_;
  float age_;                         // seconds
  float age_weight_;                  // exp(-age / age_scale)
  cv::Vec3f gain_{1.0F, 1.0F, 1.0F};  // BGR
};

}  // namespace roslam
