// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/restoration/source_image.hpp"

namespace roslam {

/// Points of a target image, with depth and a brightness gradient, for direct alignment of source images.
class AlignmentPoints {
 public:
  /// free: CV_8UC1, nonzero where the target shows the static scene. A target without depth gives no points.
  /// rays must outlive this.
  AlignmentPoints(const PixelRays& rays, const PosedImage& target, const cv::Mat& free);

  /// Refines T_source_target (metres) by direct alignment: least squares of the photometric error (Kerl,
  /// Sturm, Cremers: "Robust odometry estimation for RGB-D cameras", ICRA 2013), coarse to fine, with a prior
  /// of the uncertainty of a tracked pose, whose error shifts reprojected pixels visibly. Returns the input
  /// unchanged if the photometric error does not decrease. Thread-safe.
  SE3 aligned(const SourceImage& source, const SE3& T_source_target) const;

 private:
  struct Point {
    Eigen::Vector3f point;  // in the target camera's frame
    std::array<float, kGreyLevels> brightness;
  };
  struct Fit;

  Fit fit_of(const SourceImage& source, const SE3& T_source_target, std::size_t level, float gain) const;
  float gain_of(const SourceImage& source, const SE3& T_source_target) const;

  const PixelRays& rays_;
  std::vector<Point> points_;
};

}  // namespace roslam
