// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/image_alignment.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "roslam/common/upper_median.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/restoration/source_warp.hpp"

namespace roslam {

namespace {
constexpr int kStride = 5;            // pixels between points
constexpr float kMinGradient = 4.0F;  // grey levels per pixel of the finest level
constexpr std::size_t kMostPoints = 1500;
constexpr std::size_t kFewestPoints = 60;
constexpr int kIterations = 4;              // at each level
constexpr float kNoise = 8.0F;              // grey levels, scale of the Cauchy weight
constexpr double kTranslationSigma = 0.02;  // metres, prior: uncertainty of a tracked pose ...
constexpr double kRotationSigma = 0.01;     // ... radians
constexpr float kSameSurface = 0.06F;       // relative depth difference up to which a point counts as visible

// Bilinearly interpolated brightness of a grey image and its gradient.
struct Sample {
  float value, gradient_x, gradient_y;
};

bool sample(const cv::Mat& grey, float x, float y, Sample& result) {
  const int left = static_cast<int>(x), top = static_cast<int>(y);
  if (x < 0.0F || y < 0.0F || left + 1 >= grey.cols || top + 1 >= grey.rows) return false;
  const auto* upper = grey.ptr<std::uint8_t>(top) + left;
  const auto* lower = grey.ptr<std::uint8_t>(top + 1) + left;
  const float fx = x - static_cast<float>(left), fy = y - static_cast<float>(top);
  const float a = upper[0], b = upper[1], c = lower[0], d = lower[1];
  result.gradient_x = (1.0F - fy) * (b - a) + fy * (d - c);
  result.gradient_y = (1.0F - fx) * (c - a) + fx * (d - b);
  result.value = (1.0F - fy) * ((1.0F - fx) * a + fx * b) + fy * ((1.0F - fx) * c + fx * d);
  return true;
}

// A pixel coordinate of the full image in a level smaller by a factor.
float at_level(float pixel, float factor) { return (pixel + 0.5F) / factor - 0.5F; }

float factor_of(std::size_t level) { return static_cast<float>(2U << level); }
}  // namespace

// Normal equations of the photometric error.
struct AlignmentPoints::Fit {
  Matrix6d normal = Matrix6d::Zero();
  Vector6d right = Vector6d::Zero();
  double cost = 0.0;  // mean robust cost of the visible points
  std::size_t visible = 0;
};

AlignmentPoints::AlignmentPoints(const PixelRays& rays, const PosedImage& target, const cv::Mat& free)
    : rays_(rays) {
  if (target.depth.empty()) return;
  const auto grey = grey_levels(target.colour);
  for (int y = kStride; y + kStride < target.depth.rows; y += kStride) {
    for (int x = kStride; x + kStride < target.depth.cols; x += kStride) {
      const float depth = target.depth.at<float>(y, x);
      if (!(depth > 0.0F) || free.at<std::uint8_t>(y, x) == 0) continue;
      Point point{rays.point(x, y, depth), {}};
      Sample first{};
      bool is_inside = true;
      for (std::size_t level = 0; level < kGreyLevels; ++level) {
        Sample at{};
        is_inside &= sample(grey[level], at_level(static_cast<float>(x), factor_of(level)),
                            at_level(static_cast<float>(y), factor_of(level)), at);
        point.brightness[level] = at.value;
        if (level == 0) first = at;
      }
      if (is_inside && std::abs(first.gradient_x) + std::abs(first.gradient_y) >= kMinGradient)
        points_.push_back(point);
    }
  }
  const std::size_t stride = points_.size() / kMostPoints + 1;
  for (std::size_t i = 0; i * stride < points_.size(); ++i) points_[i] = points_[i * stride];
  points_.resize((points_.size() + stride - 1) / stride);
}

float AlignmentPoints::gain_of(const SourceImage& source, const SE3& T_source_target) const {
  const SE3f motion(T_source_target);
  std::vector<float> ratios;
  for (const Point& p : points_) {
    const auto pixel = rays_.pixel(motion * p.point);
    Sample at_pixel{};
    const float factor = factor_of(kGreyLevels - 1);
    if (pixel &&
        sample(source.grey.back(), at_level(pixel->x(), factor), at_level(pixel->y(), factor), at_pixel) &&
        at_pixel.value > 1.0F)
      ratios.push_back(p.brightness.back() / at_pixel.value);
  }
  return ratios.size() < kFewestPoints ? 1.0F : upper_median(ratios);
}

AlignmentPoints::Fit AlignmentPoints::fit_of(const SourceImage& source, const SE3& T_source_target,
                                             std::size_t level, float gain) const {
  const SE3f motion(T_source_target);
  const float factor = factor_of(level);
  const float fx = static_cast<float>(rays_.camera().fx) / factor,
              fy = static_cast<float>(rays_.camera().fy) / factor;
  Eigen::Matrix<float, 6, 6> normal = Eigen::Matrix<float, 6, 6>::Zero();
  Eigen::Matrix<float, 6, 1> right = Eigen::Matrix<float, 6, 1>::Zero();
  Fit fit;
  for (const Point& p : points_) {
    const Eigen::Vector3f point = motion * p.point;
    const auto pixel = rays_.pixel(point);
    if (!pixel) continue;
    const cv::Point nearest(static_cast<int>(pixel->x() + 0.5F), static_cast<int>(pixel->y() + 0.5F));
    const float source_depth = source.depth.at<float>(nearest);
    if (!(source_depth > 0.0F) || std::abs(source_depth - point.z()) > kSameSurface * point.z()) continue;
    Sample at_pixel{};
    if (!sample(source.grey[level], at_level(pixel->x(), factor), at_level(pixel->y(), factor), at_pixel))
      continue;
    const float residual = gain * at_pixel.value - p.brightness[level];
    const float weight = 1.0F / (1.0F + residual * residual / (kNoise * kNoise));  // Cauchy
    const float x = point.x(), y = point.y(), z = point.z();
    const float gradient_x = gain * at_pixel.gradient_x * fx / z,
                gradient_y = gain * at_pixel.gradient_y * fy / z;
    const float gradient_z = -(gradient_x * x + gradient_y * y) / z;
    Eigen::Matrix<float, 6, 1> jacobian;  // by translation and rotation: gradient and point x gradient
    jacobian << gradient_x, gradient_y, gradient_z, y * gradient_z - z * gradient_y,
        z * gradient_x - x * gradient_z, x * gradient_y - y * gradient_x;
    normal.selfadjointView<Eigen::Upper>().rankUpdate(jacobian, weight);
    right += weight * residual * jacobian;
    fit.cost += std::log1p(static_cast<double>(residual * residual / (kNoise * kNoise)));
    ++fit.visible;
  }
  fit.normal =
      Eigen::Matrix<float, 6, 6>(normal.selfadjointView<Eigen::Upper>()).cast<double>() / (kNoise * kNoise);
  fit.right = right.cast<double>() / (kNoise * kNoise);
  fit.cost /= static_cast<double>(std::max<std::size_t>(fit.visible, 1));
  return fit;
}

SE3 AlignmentPoints::aligned(const SourceImage& source, const SE3& T_source_target) const {
  const float gain = gain_of(source, T_source_target);
  const Fit before = fit_of(source, T_source_target, 0, gain);
  if (before.visible < kFewestPoints) return T_source_target;
  Vector6d prior;
  prior << Eigen::Vector3d::Constant(1.0 / (kTranslationSigma * kTranslationSigma)),
      Eigen::Vector3d::Constant(1.0 / (kRotationSigma * kRotationSigma));
  SE3 T = T_source_target;
  for (std::size_t level = kGreyLevels; level-- > 0;) {
    for (int i = 0; i < kIterations; ++i) {
      Fit fit = fit_of(source, T, level, gain);
      if (fit.visible < kFewestPoints) return T_source_target;
      const Vector6d moved = (T * T_source_target.inverse()).log();
      fit.normal.diagonal() += prior;
      fit.right += prior.cwiseProduct(moved);
      T = SE3::exp(-fit.normal.ldlt().solve(fit.right)) * T;
    }
  }
  const Fit after = fit_of(source, T, 0, gain);
  const bool is_better = T.is_finite() && after.cost < before.cost && 2 * after.visible > before.visible;
  return is_better ? T : T_source_target;
}

}  // namespace roslam
