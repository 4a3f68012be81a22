// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>

#include "roslam/geometry/camera.hpp"

namespace roslam {

/// Where each pixel of a camera looks, lens distortion undone: the point (x, y, 1) of its ray in the camera
/// frame. NaN in corners where distortion cannot be undone. Single precision: what is done with whole
/// pictures does not need more.
class PixelRays {
 public:
  explicit PixelRays(const Camera& camera);

  const Camera& camera() const { return camera_; }
  cv::Size size() const { return rays_.size(); }
  /// The rays of a row of pixels: x and y at z = 1.
  const cv::Vec2f* row(int y) const { return rays_.ptr<cv::Vec2f>(y); }

  /// The point in the camera frame that a pixel shows at depth z (metres along the optical axis).
  Eigen::Vector3f point(int x, int y, float z) const {
    const cv::Vec2f& ray = rays_.at<cv::Vec2f>(y, x);
    return {ray[0] * z, ray[1] * z, z};
  }

  /// Where the image as taken shows a point of the camera frame. Nothing if the point lies behind the camera,
  /// nearer than 5 cm, or beyond the centres of the outermost pixels.
  std::optional<Eigen::Vector2f> pixel(const Eigen::Vector3f& point) const;

 private:
  Camera camera_;
  cv::Mat rays_;                // CV_32FC2
  Eigen::Vector2f low_, high_;  // rays of all pixels lie between
  bool has_distortion_;
};

}  // namespace roslam
