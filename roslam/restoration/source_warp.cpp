// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/source_warp.hpp"

#include <algorithm>
#include <array>
#include <cmath>
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
