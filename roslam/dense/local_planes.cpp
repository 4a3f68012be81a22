// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/local_planes.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <optional>

namespace roslam {

namespace {
constexpr int kRadius = 4;                // pixels from the pixel to the farthest neighbour
constexpr int kStep = 2;                  // pixels between neighbours
constexpr float kSameSurface = 0.05F;     // largest relative difference of a neighbour's inverse depth
constexpr float kGrazingSurface = 0.12F;  // the same at grazing angles, where neighbours differ more
constexpr int kFewest = 9;                // neighbours for a fit

// (a, b, c) of inverse depth = a du + b dv + c, du and dv in pixels from the centre. tolerance: relative.
// Nothing with too few neighbours within it.
std::optional<cv::Vec3f> fitted(const cv::Mat& inverse, int x, int y, float tolerance) {
  const float centre = inverse.at<float>(y, x);
  Eigen::Matrix3f sums = Eigen::Matrix3f::Zero();
  Eigen::Vector3f right = Eigen::Vector3f::Zero();
  int count = 0;
  for (int dy = -kRadius; dy <= kRadius; dy += kStep) {
    if (y + dy < 0 || y + dy >= inverse.rows) continue;
    const float* row = inverse.ptr<float>(y + dy);
    for (int dx = -kRadius; dx <= kRadius; dx += kStep) {
      if (x + dx < 0 || x + dx >= inverse.cols) continue;
      const float value = row[x + dx];
      if (value == 0.0F || std::abs(value - centre) > tolerance * centre) continue;
      const Eigen::Vector3f at(static_cast<float>(dx), static_cast<float>(dy), 1.0F);
      sums.noalias() += at * at.transpose();
      right += value * at;
      ++count;
    }
  }
  if (count < kFewest) return std::nullopt;
  const Eigen::Vector3f plane = sums.ldlt().solve(right);
  if (!plane.allFinite()) return std::nullopt;
  return cv::Vec3f(plane.x(), plane.y(), plane.z());
}

cv::Vec3f fitted(const cv::Mat& inverse, int x, int y) {
  if (const auto plane = fitted(inverse, x, y, kSameSurface)) return *plane;
  if (const auto plane = fitted(inverse, x, y, kGrazingSurface)) return *plane;
  return {0.0F, 0.0F, inverse.at<float>(y, x)};  // fronto-parallel
}
}  // namespace

cv::Mat local_planes(const cv::Mat& depth, const Camera& camera) {
  cv::Mat inverse = 1.0 / depth;
  inverse.setTo(0, depth == 0);
  cv::Mat planes = cv::Mat::zeros(depth.size(), CV_32FC4);
  const auto fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      if (inverse.at<float>(y, x) == 0.0F) continue;
      const cv::Vec3f fit = fitted(inverse, x, y);
      // Converts to coefficients of the ray (X / Z, Y / Z, 1).
      const float a = fit[0] * fx, b = fit[1] * fy;
      const float ray_x = (static_cast<float>(x) - cx) / fx, ray_y = (static_cast<float>(y) - cy) / fy;
      const Eigen::Vector3f m(a, b, fit[2] - a * ray_x - b * ray_y);  // m . X = 1
      const float distance = 1.0F / m.norm();
      planes.at<cv::Vec4f>(y, x) = {m.x() * distance, m.y() * distance, m.z() * distance, distance};
    }
  }
  return planes;
}

}  // namespace roslam
