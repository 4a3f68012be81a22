// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/background_reprojection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/restoration/image_alignment.hpp"
#include "roslam/restoration/source_selection.hpp"

namespace roslam {

void ReprojectionOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("reprojection.") + message);
  };
  require(views >= 1 && views <= 64, "views must be 1 to 64");
  require(depth_tolerance > 0.0 && depth_tolerance < 1.0, "depth_tolerance must be above 0 and below 1");
  require(tolerance_growth >= 0.0 && tolerance_growth < 1.0, "tolerance_growth must be 0 to 1 (1/metre)");
  require(angle_scale > 0.0 && angle_scale <= 180.0, "angle_scale must be above 0 and at most 180 degrees");
  require(age_scale > 0.0 && std::isfinite(age_scale), "age_scale must be above 0 seconds");
  require(colour_tolerance > 0.0 && colour_tolerance <= 255.0,
          "colour_tolerance must be above 0 and at most 255 grey levels");
  require(max_gain >= 1.0 && max_gain <= 100.0, "max_gain must be 1 to 100");
}

namespace {
constexpr float kHalfCertainty = 0.5F;    // sum of agreeing weights that gives a certainty of 1/2
constexpr float kCompletedWeight = 0.3F;  // factor for sources whose depth is filled in, not measured

struct PixelSurface {
  float depth = 0.0F;  // metres, 0 = none
  bool is_measured = false;
};

struct Blend {
  cv::Vec3f colour;
  float age = 0.0F;
  float certainty = 0.0F;
};

// A pixel's colour in one source.
struct ColourSample {
  cv::Vec3f colour;
  float weight;
  float age;
};

float difference(const cv::Vec3f& a, const cv::Vec3f& b) {
  return (std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2])) / 3.0F;
}

// Fills the pixels of one target.
class PixelFiller {
 public:
  PixelFiller(const PixelRays& rays, const std::vector<SourceWarp>& warps, const ReprojectionOptions& options,
              const cv::Rect& box)
      : rays_(rays),
        warps_(warps),
        options_(options),
        box_(box),
        measured_(warps.size()),
        completed_(warps.size()) {
    for (std::size_t i = 0; i < warps.size(); ++i) warps[i].splat(box, measured_[i], completed_[i]);
  }

  void fill(int x, int y, ReprojectedArea& area) {
    const PixelSurface surface = surface_at(x, y);
    if (surface.depth == 0.0F) return;
    const auto blend = blend_at(rays_.point(x, y, surface.depth));
    if (!blend) return;
    area.filled.at<std::uint8_t>(y, x) = 255;
    area.colour.at<cv::Vec3b>(y, x) = blend->colour;
    area.depth.at<float>(y, x) = surface.is_measured ? surface.depth : 0.0F;
    area.age.at<float>(y, x) = blend->age;
    area.certainty.at<float>(y, x) = blend->certainty * (surface.is_measured ? 1.0F : kCompletedWeight);
  }

 private:
  PixelSurface surface_at(int x, int y) {
    if (const float depth = nearest_supported(depths_at(measured_, x, y), x, y); depth > 0.0F)
      return {depth, true};
    return {nearest_supported(depths_at(completed_, x, y), x, y), false};
  }

  // The sources' depths at a pixel, nearest first.
  const std::vector<float>& depths_at(const std::vector<cv::Mat>& splats, int x, int y) {
    depths_.clear();
    for (const cv::Mat& splat : splats)
      if (const float depth = splat.at<float>(y - box_.y, x - box_.x); depth > 0.0F) depths_.push_back(depth);
    std::sort(depths_.begin(), depths_.end());
    return depths_;
  }

  // The nearest cluster of depths that more sources support than see through; 0 = none.
  float nearest_supported(const std::vector<float>& depths, int x, int y) const {
    for (std::size_t first = 0; first < depths.size();) {
      const float limit = depths[first] + 2.0F * warps_.front().tolerance(depths[first]);
      std::size_t last = first;
      while (last < depths.size() && depths[last] <= limit) ++last;
      const float depth = depths[first + (last - first) / 2];
      const Eigen::Vector3f point = rays_.point(x, y, depth);
      const auto contradicting =
          static_cast<std::size_t>(std::count_if(warps_.begin(), warps_.end(), [&](const SourceWarp& warp) {
            const auto warped = warp.project(point);
            return warped && warp.sees_through(*warped);
          }));
      if (contradicting < last - first) return depth;
      first = last;
    }
    return 0.0F;
  }

  std::optional<Blend> blend_at(const Eigen::Vector3f& point) {
    samples_.clear();
    for (const SourceWarp& warp : warps_) {
      const auto warped = warp.project(point);
      if (!warped || !warp.shows(*warped)) continue;
      const float weight =
          warp.weight(point, warped->depth) * (warped->is_measured ? 1.0F : kCompletedWeight);
      samples_.push_back({warp.colour(warped->pixel), weight, warp.age()});
    }
    if (samples_.empty()) return std::nullopt;
    const ColourSample& typical = consensus();
    cv::Vec3f colour;
    float age = 0.0F, sum = 0.0F, agreeing = 0.0F, all = 0.0F;
    for (const ColourSample& sample : samples_) {
      all += sample.weight;
      if (difference(sample.colour, typical.colour) > options_.colour_tolerance) continue;
      // Squared, because averaging blurs: the best source should dominate.
      const float weight = sample.weight * sample.weight;
      colour += weight * sample.colour;
      age += weight * sample.age;
      sum += weight;
      agreeing += sample.weight;
    }
    if (!(sum > 0.0F)) return std::nullopt;
    return Blend{colour / sum, age / sum, agreeing / all * agreeing / (agreeing + kHalfCertainty)};
  }

  // The weighted medoid of the colours, or, if most sources differ from it, the unweighted one: a shadow or
  // a missed dynamic object may dominate the sources close in time, but not all of them.
  const ColourSample& consensus() const {
    const ColourSample& weighted = medoid([](const ColourSample& other) { return other.weight; });
    const float limit = 2.0F * static_cast<float>(options_.colour_tolerance);
    const auto agreeing = std::count_if(samples_.begin(), samples_.end(), [&](const ColourSample& other) {
      return difference(weighted.colour, other.colour) <= limit;
    });
    if (2 * agreeing >= static_cast<std::ptrdiff_t>(samples_.size())) return weighted;
    return medoid([](const ColourSample&) { return 1.0F; });
  }

  template <typename Weight>
  const ColourSample& medoid(const Weight& weight_of) const {
    const auto limit = 2.0F * static_cast<float>(options_.colour_tolerance);
    const ColourSample* best = &samples_.front();
    float least = std::numeric_limits<float>::max();
    for (const ColourSample& one : samples_) {
      float cost = 0.0F;
      for (const ColourSample& other : samples_)
        cost += weight_of(other) * std::min(difference(one.colour, other.colour), limit);
      if (cost < least) {
        least = cost;
        best = &one;
      }
    }
    return *best;
  }

  const PixelRays& rays_;
  const std::vector<SourceWarp>& warps_;
  const ReprojectionOptions& options_;
  cv::Rect box_;
  std::vector<cv::Mat> measured_, completed_;  // CV_32FC1 depth of each source, warped into the box
  std::vector<float> depths_;                  // scratch
  std::vector<ColourSample> samples_;          // scratch
};
}  // namespace

std::vector<SourceWarp> BackgroundReprojection::warps(const PosedImage& target, const cv::Mat& area,
                                                      std::span<const SourceImage* const> sources) const {
  std::vector<SourceWarp> all;
  all.reserve(sources.size());
  const auto motion_to = [&](const SourceImage& source) {
    return source.T_world_camera.inverse() * *target.T_world_camera;
  };
  for (const SourceImage* source : sources)
    all.emplace_back(rays_, *source, motion_to(*source), target.timestamp, options_);
  cv::Mat known = target.depth.clone();
  if (!known.empty()) known.setTo(0, area);
  auto chosen = select_sources(all, hidden_points(rays_, area, known), options_.views);
  const cv::Mat free = area == 0;
  const AlignmentPoints points(rays_, target, free);
  for (SourceWarp& warp : chosen) {
    if (options_.align)
      warp = SourceWarp(rays_, warp.source(), points.aligned(warp.source(), motion_to(warp.source())),
                        target.timestamp, options_);
    warp.match_exposure(target, free);
  }
  return chosen;
}

ReprojectedArea BackgroundReprojection::fill(const PosedImage& target, const cv::Mat& area,
                                             std::span<const SourceImage* const> sources) const {
  const cv::Size size = target.colour.size();
  ReprojectedArea result{cv::Mat::zeros(size, CV_8UC1), cv::Mat::zeros(size, CV_8UC3),
                         cv::Mat::zeros(size, CV_32FC1), cv::Mat::zeros(size, CV_32FC1),
                         cv::Mat::zeros(size, CV_32FC1)};
  const cv::Rect box = cv::boundingRect(area);
  if (box.empty() || !target.T_world_camera) return result;
  const auto chosen = warps(target, area, sources);
  if (chosen.empty()) return result;
  PixelFiller filler(rays_, chosen, options_, box);
  for (int y = box.y; y < box.br().y; ++y)
    for (int x = box.x; x < box.br().x; ++x)
      if (area.at<std::uint8_t>(y, x) != 0) filler.fill(x, y, result);
  return result;
}

}  // namespace roslam
