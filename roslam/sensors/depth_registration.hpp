// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// Depth registration: brings the depth image of one camera into the image of another. Two corners of each
/// depth pixel are projected, and the pixels between them get its depth along the other's optical axis, so
/// that a surface has no gaps where the other image has more pixels; of several surfaces the nearest wins,
/// which is what the other camera sees. Pixels that the depth camera could not see stay unknown. A pixel on a
/// surface that is seen at a grazing angle is off by up to half a depth pixel.
///
/// Thread safety: operator() may be called from several threads at once.
class ROSLAM_EXPORT DepthRegistration {
 public:
  /// T_colour_depth: from the depth camera's frame to the colour camera's. Throws CalibrationError if a
  /// camera is not valid or the transform is not finite.
  DepthRegistration(const Camera& depth, const Camera& colour, const SE3& T_colour_depth);

  /// Whether there is nothing to do: both cameras are one.
  bool is_identity() const { return is_identity_; }

  /// depth: metres, CV_32FC1, of the depth camera's size; 0, NaN or negative is unknown. Returns metres,
  /// CV_32FC1, of the colour camera's size, 0 where unknown. Throws InputError for an image of another size
  /// or type.
  cv::Mat operator()(const cv::Mat& depth) const;

 private:
  struct Row;
  void project(const float* depth, int row, Row& projected) const;
  void measure_seams();
  void distort(std::vector<float>& x, std::vector<float>& y) const;
  void project_corners(const float* depth, std::size_t corners, Row& row) const;

  cv::Size from_, to_;
  bool is_identity_ = false;
  bool has_distortion_ = false;
  // Rays of the pixel corners, at depth 1, times the colour camera's matrix and the rotation: three planes of
  // (height + 1) x (width + 1). A point at depth z projects to z * ray + offset_ (homogeneous).
  std::vector<float> x_, y_, z_;
  std::vector<float> centre_z_;  // of the pixel centres: depth in the colour camera for depth 1
  Eigen::Vector3f offset_ = Eigen::Vector3f::Zero();
  float seam_x_ = 0.0F, seam_y_ = 0.0F;  // pixels that rectangles are widened by, so that they leave no gaps
  cv::Mat displacement_;  // CV_32FC2, of the raw from the undistorted pixel; empty without distortion
};

}  // namespace roslam
