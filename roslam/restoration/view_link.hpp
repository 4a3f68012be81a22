// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>

#include "roslam/geometry/motion.hpp"
#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/restoration/reprojection_options.hpp"
#include "roslam/restoration/view.hpp"

namespace roslam {

/// How a source sees a point of the target.
struct Sighting {
  Eigen::Vector2f pixel;     ///< of the source
  float depth = 0.0F;        ///< metres, of the point in the source
  float seen = 0.0F;         ///< metres, what the source has there; 0 = unknown
  bool is_measured = false;  ///< what it has is measured
  bool is_static = false;    ///< nothing was removed from the source there
};

/// A source view beside the target that is to be filled from it.
class ViewLink {
 public:
  /// rays: of the camera that took both. All must outlive the link.
  ViewLink(const PixelRays& rays, const SourceView& source, const SE3& T_source_target, double target_time,
           const ReprojectionOptions& options);

  /// point: in the target camera's frame. Nothing if the source's picture does not reach there.
  std::optional<Sighting> look_at(const Eigen::Vector3f& point) const;

  /// How far two depths of one surface may differ, metres.
  float tolerance(float depth) const { return (tolerance_ + growth_ * depth) * depth; }

  /// The source shows the point itself.
  bool shows(const Sighting& s) const {
    return s.is_static && s.seen > 0.0F && std::abs(s.seen - s.depth) <= tolerance(s.depth);
  }

  /// The source looks through the point at what lies behind it: nothing can be there.
  bool sees_through(const Sighting& s) const {
    return s.is_static && s.is_measured && s.seen - s.depth > 2.0F * tolerance(s.seen);
  }

  /// What the source says about the colour of a point, from 0 to 1: less the older it is, the more it looks
  /// from elsewhere and the farther it is away.
  float weight(const Eigen::Vector3f& point, float depth_in_source) const;

  /// Colour at a pixel of the source between four others, with the gain to the target.
  cv::Vec3f colour(const Eigen::Vector2f& pixel) const;

  /// Depth of the source's static pixels as the target sees them (CV_32FC1, 0 = none), in the area of the
  /// target's picture: what is measured and what is guessed.
  void splat(const cv::Rect& area, cv::Mat& measured, cv::Mat& guessed) const;

  /// Finds the factor, by channel, between the brightness of both pictures from what both show. free: nonzero
  /// where the target shows the static scene.
  void match_light(const View& target, const cv::Mat& free);

  float age() const { return age_; }
  const SourceView& source() const { return *source_; }

 private:
  const PixelRays* rays_;
  const SourceView* source_;
  Motion source_from_target_;
  Motion target_from_source_;
  Eigen::Vector3f centre_;  // of the source in the target's frame
  float tolerance_, growth_, angle_scale_, max_gain_;
  float age_;     // seconds between both
  float fading_;  // what age leaves of the weight
  cv::Vec3f gain_{1.0F, 1.0F, 1.0F};
};

}  // namespace roslam
