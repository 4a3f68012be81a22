// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/pixel_rays.hpp"

#include <limits>

namespace roslam {

namespace {
constexpr float kNearest = 0.05F;  // metres
}  // namespace

PixelRays::PixelRays(const Camera& camera)
    : camera_(camera),
      rays_(camera.height, camera.width, CV_32FC2),
      has_distortion_(camera.has_distortion()) {
  low_.setConstant(std::numeric_limits<float>::max());
  high_ = -low_;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      auto& stored = rays_.at<cv::Vec2f>(y, x) = cv::Vec2f::all(std::numeric_limits<float>::quiet_NaN());
      const auto undistorted = camera.try_undistort(Eigen::Vector2d(x, y));
      if (!undistorted) continue;
      const Eigen::Vector3d ray = camera.unproject(*undistorted, 1.0);
      stored = {static_cast<float>(ray.x()), static_cast<float>(ray.y())};
      low_ = low_.cwiseMin(ray.head<2>().cast<float>());
      high_ = high_.cwiseMax(ray.head<2>().cast<float>());
    }
  }
}

std::optional<Eigen::Vector2f> PixelRays::pixel(const Eigen::Vector3f& point) const {
  if (!(point.z() > kNearest)) return std::nullopt;
  const Eigen::Vector2f ray = point.head<2>() / point.z();
  // Far outside the image the distortion model may map points back into it.
  if (!(ray.x() >= low_.x() && ray.y() >= low_.y() && ray.x() <= high_.x() && ray.y() <= high_.y()))
    return std::nullopt;
  const auto fx = static_cast<float>(camera_.fx), fy = static_cast<float>(camera_.fy);
  Eigen::Vector2f pixel(fx * ray.x() + static_cast<float>(camera_.cx),
                        fy * ray.y() + static_cast<float>(camera_.cy));
  if (has_distortion_) pixel = camera_.distort(pixel.cast<double>()).cast<float>();
  const bool is_inside = pixel.x() >= 0.0F && pixel.y() >= 0.0F &&
                         pixel.x() <= static_cast<float>(rays_.cols - 1) &&
                         pixel.y() <= static_cast<float>(rays_.rows - 1);
  return is_inside ? std::optional(pixel) : std::nullopt;
}

void PixelRays::pixels(std::size_t count, float* x, float* y, const float* z) const {
  constexpr float kUnlimited = std::numeric_limits<float>::max();
  const auto fx = static_cast<float>(camera_.fx), fy = static_cast<float>(camera_.fy);
  const auto cx = static_cast<float>(camera_.cx), cy = static_cast<float>(camera_.cy);
  const float low_x = low_.x(), low_y = low_.y(), high_x = high_.x(), high_y = high_.y();
  const float first = has_distortion_ ? -kUnlimited : 0.0F;
  const float right = has_distortion_ ? kUnlimited : static_cast<float>(rays_.cols - 1);
  const float bottom = has_distortion_ ? kUnlimited : static_cast<float>(rays_.rows - 1);
  for (std::size_t i = 0; i < count; ++i) {  // without branches: the compiler vectorises it
    const float ray_x = x[i] / z[i], ray_y = y[i] / z[i];
    const float pixel_x = fx * ray_x + cx, pixel_y = fy * ray_y + cy;
    float kept = z[i] > kNearest ? pixel_x : -kUnlimited;
    kept = ray_x >= low_x && ray_x <= high_x ? kept : -kUnlimited;
    kept = ray_y >= low_y && ray_y <= high_y ? kept : -kUnlimited;
    kept = pixel_x >= first && pixel_x <= right ? kept : -kUnlimited;
    kept = pixel_y >= first && pixel_y <= bottom ? kept : -kUnlimited;
    x[i] = kept;
    y[i] = pixel_y;
  }
  if (!has_distortion_) return;
  for (std::size_t i = 0; i < count; ++i) {
    if (x[i] == -kUnlimited) continue;
    const Eigen::Vector2f pixel = camera_.distort(Eigen::Vector2d(x[i], y[i])).cast<float>();
    const bool is_inside = pixel.x() >= 0.0F && pixel.y() >= 0.0F &&
                           pixel.x() <= static_cast<float>(rays_.cols - 1) &&
                           pixel.y() <= static_cast<float>(rays_.rows - 1);
    x[i] = is_inside ? pixel.x() : -kUnlimited;
    y[i] = pixel.y();
  }
}

}  // namespace roslam
