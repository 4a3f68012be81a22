// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

class PixelDistortion;

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
  struct Rays;
  struct Row;
  void fill_table(const Camera& depth);
  Rays corners(int row, std::vector<float>& memory) const;
  void measure_seams();
  void locate(const float* depth, const Rays& rays, std::vector<float>& x, std::vector<float>& y) const;
  void project(const float* depth, int row, Row& projected) const;

  cv::Size from_, to_;
  bool is_identity_ = false;
  // The ray of a pixel (u, v, 1) of the depth image, at depth 1, times the rotation and the colour camera's
  // matrix. A point at depth z projects to z * ray + offset_ (homogeneous).
  Eigen::Matrix3d ray_of_pixel_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3f offset_ = Eigen::Vector3f::Zero();
  // The same of the pixel corners of a depth camera with distortion, else empty: rows of height + 1, in each
  // x, y and z of width + 1.
  std::vector<float> table_;
  float seam_x_ = 0.0F, seam_y_ = 0.0F;  // pixels that rectangles are widened by, so that they leave no gaps
  std::shared_ptr<const PixelDistortion> distortion_;  // of the colour camera; null if it has none
};

}  // namespace roslam
