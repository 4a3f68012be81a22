// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>

#include "roslam/geometry/camera.hpp"

namespace roslam {

/// Viewing ray of each pixel of a camera, lens distortion removed: its point (x, y, 1) in the camera frame.
/// NaN in corners where distortion cannot be inverted. Single precision, enough for dense images. Immutable,
/// so safe to read from several threads.
class PixelRays {
 public:
  explicit PixelRays(const Camera& camera);

  const Camera& camera() const { return camera_; }
  cv::Size size() const { return rays_.size(); }
  /// The rays of a row of pixels: x and y at z = 1.
  const cv::Vec2f* row(int y) const { return rays_.ptr<cv::Vec2f>(y); }

  /// The point in the camera frame seen at a pixel with depth z (metres along the optical axis).
  Eigen::Vector3f point(int x, int y, float z) const {
    const cv::Vec2f& ray = rays_.at<cv::Vec2f>(y, x);
    return {ray[0] * z, ray[1] * z, z};
  }

  /// Projects a point of the camera frame to a pixel of the raw (distorted) image. Nothing if the point lies
  /// behind the camera, nearer than 5 cm, or beyond the centres of the outermost pixels.
  std::optional<Eigen::Vector2f> pixel(const Eigen::Vector3f& point) const;

  /// pixel() of many points, given by coordinate and overwritten: x and y become the pixel, x becomes
  /// negative where pixel() gives nothing.
  void pixels(std::size_t count, float* x, float* y, const float* z) const;

 private:
  Camera camera_;
  cv::Mat rays_;                // CV_32FC2
  Eigen::Vector2f low_, high_;  // bounds of all rays
  bool has_distortion_;
};

}  // namespace roslam
