// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/source_warp.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "roslam/common/upper_median.hpp"

namespace roslam {

namespace {
constexpr int kExposureStride = 8;              // pixels between samples of the exposure gain
constexpr std::size_t kExposureSamples = 50;    // with fewer the gain is not estimated
constexpr int kDarkest = 12, kBrightest = 243;  // beyond these a pixel is under- or overexposed

bool is_well_exposed(const cv::Vec3b& colour) {
  return *std::min_element(colour.val, colour.val + 3) >= kDarkest &&
         *std::max_element(colour.val, colour.val + 3) <= kBrightest;
}

// Points of a row of pixels, by coordinate.
struct PointRow {
  explicit PointRow(int width) : x(static_cast<std::size_t>(width)), y(x.size()), z(x.size()) {}
  std::vector<float> x, y, z;
};

// The points that a row of pixels shows at the given depths, moved. The compiler vectorises the loop.
void move_points(const SE3f& motion, const cv::Vec2f* rays, const float* depths, PointRow& points) {
  const Eigen::Matrix3f& R = motion.rotation;
  const Eigen::Vector3f& t = motion.translation;
  const float r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2), t0 = t(0);
  const float r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2), t1 = t(1);
  const float r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2), t2 = t(2);
  float *to_x = points.x.data(), *to_y = points.y.data(), *to_z = points.z.data();
  const float* ray = rays->val;
  for (std::size_t i = 0; i < points.z.size(); ++i) {
    const float z = depths[i], x = ray[2 * i] * z, y = ray[2 * i + 1] * z;
    to_x[i] = r00 * x + (r01 * y + r02 * z) + t0;
    to_y[i] = r10 * x + (r11 * y + r12 * z) + t1;
    to_z[i] = r20 * x + (r21 * y + r22 * z) + t2;
  }
}

// A reading is splatted to the four pixels around it, so that a source a little farther away leaves no gaps.
void keep_nearest(float* corner, std::size_t stride, float depth) {
  for (float* kept : {corner, corner + 1, corner + stride, corner + stride + 1})
    *kept = std::min(*kept, depth);
}
}  // namespace

SourceWarp::SourceWarp(const PixelRays& rays, const SourceImage& source, const SE3& T_source_target,
                       double target_time, const ReprojectionOptions& options)
    : rays_(&rays),
      source_(&source),
      source_from_target_(T_source_target),
      target_from_source_(T_source_target.inverse()),
      centre_(target_from_source_.translation),
      tolerance_(static_cast<float>(options.depth_tolerance)),
      growth_(static_cast<float>(options.tolerance_growth)),
      angle_scale_(static_cast<float>(options.angle_scale * M_PI / 180.0)),
      max_gain_(static_cast<float>(options.max_gain)),
      age_(static_cast<float>(std::abs(target_time - source.timestamp))),
      age_weight_(std::exp(-age_ / static_cast<float>(options.age_scale))) {}

std::optional<WarpedPoint> SourceWarp::project(const Eigen::Vector3f& point) const {
  const Eigen::Vector3f in_source = source_from_target_ * point;
  const auto pixel = rays_->pixel(in_source);
  if (!pixel) return std::nullopt;
  WarpedPoint warped{*pixel, in_source.z()};
  look_up(warped);
  return warped;
}

float SourceWarp::weight(const Eigen::Vector3f& point, float depth_in_source) const {
  const Eigen::Vector3f from_source = point - centre_;
  const float cosine = point.dot(from_source) / (point.norm() * from_source.norm() + 1e-9F);
  const float angle = std::acos(std::clamp(cosine, -1.0F, 1.0F));
  const float sharpness = std::min(1.0F, point.z() / depth_in_source);
  return age_weight_ * std::exp(-angle / angle_scale_) * sharpness * sharpness;
}

cv::Vec3f SourceWarp::colour(const Eigen::Vector2f& pixel) const {
  const cv::Mat& image = source_->colour;
  const int x = std::min(static_cast<int>(pixel.x()), image.cols - 2);
  const int y = std::min(static_cast<int>(pixel.y()), image.rows - 2);
  const float right = pixel.x() - static_cast<float>(x);
  const float low = pixel.y() - static_cast<float>(y);
  const cv::Vec3b* above = image.ptr<cv::Vec3b>(y) + x;
  const cv::Vec3b* below = image.ptr<cv::Vec3b>(y + 1) + x;
  cv::Vec3f result;
  for (int c = 0; c < 3; ++c) {
    const auto upper_left = static_cast<float>(above[0][c]), upper_right = static_cast<float>(above[1][c]);
    const auto lower_left = static_cast<float>(below[0][c]), lower_right = static_cast<float>(below[1][c]);
    const float upper = upper_left + right * (upper_right - upper_left);
    const float lower = lower_left + right * (lower_right - lower_left);
    result[c] = gain_[c] * (upper + low * (lower - upper));
  }
  return result;
}

void SourceWarp::splat(const cv::Rect& area, cv::Mat& measured, cv::Mat& completed) const {
  const cv::Size size(area.width + 2, area.height + 2);
  const cv::Scalar none(std::numeric_limits<float>::infinity());
  measured = cv::Mat(size, CV_32FC1, none);
  completed = cv::Mat(size, CV_32FC1, none);
  PointRow points(source_->depth.cols);
  // Of the pixels (x, y) around which all four pixels are in the images.
  const auto left = static_cast<float>(area.x - 1), top = static_cast<float>(area.y - 1);
  const auto right = static_cast<float>(area.br().x), bottom = static_cast<float>(area.br().y);
  for (int y = 0; y < source_->depth.rows; ++y) {
    const float* depths = source_->depth.ptr<float>(y);
    const auto* is_measured = source_->is_measured.ptr<std::uint8_t>(y);
    move_points(target_from_source_, rays_->row(y), depths, points);
    rays_->pixels(points.z.size(), points.x.data(), points.y.data(), points.z.data());
    for (std::size_t x = 0; x < points.z.size(); ++x) {
      const float to_x = points.x[x], to_y = points.y[x];
      if (!(to_x >= 0.0F) || to_x < left || to_x >= right || to_y < top || to_y >= bottom) continue;
      if (depths[x] == 0.0F) continue;
      cv::Mat& image = is_measured[x] != 0 ? measured : completed;
      float* corner =
          image.ptr<float>(static_cast<int>(to_y) - area.y + 1) + static_cast<int>(to_x) - area.x + 1;
      keep_nearest(corner, image.step1(), points.z[x]);
    }
  }
}

void SourceWarp::match_exposure(const PosedImage& target, const cv::Mat& free) {
  if (target.depth.empty()) return;
  std::array<std::vector<float>, 3> ratios;
  for (int y = kExposureStride / 2; y < target.depth.rows; y += kExposureStride) {
    for (int x = kExposureStride / 2; x < target.depth.cols; x += kExposureStride) {
      const float depth = target.depth.at<float>(y, x);
      if (!(depth > 0.0F) || free.at<std::uint8_t>(y, x) == 0) continue;
      const auto warped = project(rays_->point(x, y, depth));
      if (!warped || !warped->is_measured || !shows(*warped)) continue;
      const auto& taken = target.colour.at<cv::Vec3b>(y, x);
      const auto& other =
          source_->colour.at<cv::Vec3b>(cvRound(warped->pixel.y()), cvRound(warped->pixel.x()));
      if (!is_well_exposed(taken) || !is_well_exposed(other)) continue;
      for (int c = 0; c < 3; ++c)
        ratios[static_cast<std::size_t>(c)].push_back(static_cast<float>(taken[c]) /
                                                      static_cast<float>(other[c]));
    }
  }
  for (int c = 0; c < 3; ++c) {
    auto& ratio = ratios[static_cast<std::size_t>(c)];
    if (ratio.size() < kExposureSamples) return;
    gain_[c] = std::clamp(upper_median(ratio), 1.0F / max_gain_, max_gain_);
  }
}

}  // namespace roslam
