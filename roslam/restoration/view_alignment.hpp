// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/restoration/view.hpp"

namespace roslam {

/// Points of a picture by which others are laid over it: where brightness changes, with known depth.
class AlignmentPoints {
 public:
  /// free: CV_8UC1, nonzero where the target shows the static scene. Without depth there are no points.
  AlignmentPoints(const PixelRays& rays, const View& target, const cv::Mat& free);

  /// Corrects T_source_target (metres) so that what the source shows lies over what the target shows: direct
  /// alignment, least squares of the difference of brightness (Kerl, Sturm, Cremers: "Robust odometry
  /// estimation for RGB-D cameras", ICRA 2013), coarse to fine, within the uncertainty of a tracked pose.
  /// Errors of a pose that tracking does not mind are pixels here. The motion comes back as it was where this
  /// does not make both more alike.
  SE3 aligned(const SourceView& source, const SE3& T_source_target) const;

 private:
  struct Point {
    Eigen::Vector3f point;  // in the target camera's frame
    std::array<float, kGreyLevels> brightness;
  };
  struct Fit;

  Fit fit_of(const SourceView& source, const SE3& T_source_target, std::size_t level, float gain) const;
  float gain_of(const SourceView& source, const SE3& T_source_target) const;

  const PixelRays& rays_;
  std::vector<Point> points_;
};

}  // namespace roslam
