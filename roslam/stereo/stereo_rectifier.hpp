// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/common/export.hpp"
#include "roslam/geometry/stereo_rig.hpp"

namespace roslam {

/// Rectifies stereo pairs: both images become those of pinhole cameras with the same intrinsics and parallel
/// axes, so that a point is on the same row of both. The x axis is the baseline, the z axis the mean of the
/// optical axes made perpendicular to it (Fusiello et al., Machine Vision and Applications 2000). The field
/// of view is the largest that both images fill, of wide lenses at most 50 degrees to each side. Images of a
/// pair that is rectified already are passed on as they are. Safe to use from several threads.
class ROSLAM_EXPORT StereoRectifier {
 public:
  /// Throws CalibrationError if a camera is invalid, the image sizes differ, the baseline is zero, above 10 m
  /// or not along the rows, the cameras are swapped, or their views hardly overlap.
  StereoRectifier(const Camera& left, const RightCamera& right);

  /// The left camera of the rectified pair, with its baseline, its mount and its inertial unit.
  const Camera& camera() const { return camera_; }

  /// Turns the frame of the rectified camera to that of the left camera; the origin is the same.
  const SE3& T_left_rectified() const { return T_left_rectified_; }

  /// Whether the pair is rectified already.
  bool is_identity() const { return is_identity_; }

  /// The rectified images: of the size and type of those given, which are of the calibrated size.
  cv::Mat left(const cv::Mat& image) const { return warp(image, left_map_); }
  cv::Mat right(const cv::Mat& image) const { return warp(image, right_map_); }

 private:
  struct PixelMap {
    cv::Mat pixels, fractions;  // as cv::convertMaps gives them
  };

  PixelMap map_of(const Camera& raw, const Eigen::Matrix3d& R_raw_rectified) const;
  cv::Mat warp(const cv::Mat& image, const PixelMap& map) const;

  Camera camera_;
  SE3 T_left_rectified_;
  bool is_identity_ = false;
  PixelMap left_map_, right_map_;
};

}  // namespace roslam
