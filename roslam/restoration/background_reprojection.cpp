// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/background_reprojection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/restoration/colour_samples.hpp"
#include "roslam/restoration/image_alignment.hpp"
#include "roslam/restoration/source_selection.hpp"
#include "roslam/restoration/warp_group.hpp"
#include "roslam/restoration/warped_depths.hpp"

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

// Fills the pixels of one target.
class PixelFiller {
 public:
  PixelFiller(const PixelRays& rays, const std::vector<SourceWarp>& warps, const ReprojectionOptions& options,
              const cv::Mat& area)
      : rays_(rays),
        warps_(warps),
        depths_(rays, warps, area),
        group_(rays, warps),
        samples_(static_cast<float>(options.colour_tolerance)) {}

  void fill(int x, int y, ReprojectedArea& area) {
    const PixelSurface surface = surface_at(x, y);
    if (surface.depth == 0.0F) return;
    const auto blend = blended();
    if (!blend) return;
    area.filled.at<std::uint8_t>(y, x) = 255;
    area.colour.at<cv::Vec3b>(y, x) = blend->colour;
    area.depth.at<float>(y, x) = surface.is_measured ? surface.depth : 0.0F;
    area.age.at<float>(y, x) = blend->age;
    area.certainty.at<float>(y, x) = blend->certainty * (surface.is_measured ? 1.0F : kCompletedWeight);
  }

 private:
  PixelSurface surface_at(int x, int y) {
    if (const float depth = nearest_supported(sorted(depths_.measured(x, y)), x, y); depth > 0.0F)
      return {depth, true};
    return {nearest_supported(sorted(depths_.completed(x, y)), x, y), false};
  }

  // Known depths, nearest first.
  const std::vector<float>& sorted(std::span<const float> depths) {
    sorted_.clear();
    for (const float depth : depths)
      if (depth < std::numeric_limits<float>::infinity()) sorted_.push_back(depth);
    std::sort(sorted_.begin(), sorted_.end());
    return sorted_;
  }

  // The nearest cluster of depths that more sources support than see through; 0 = none. Of all points it is
  // the one projected last.
  float nearest_supported(const std::vector<float>& depths, int x, int y) {
    for (std::size_t first = 0; first < depths.size();) {
      const float limit = depths[first] + 2.0F * warps_.front().tolerance(depths[first]);
      std::size_t last = first;
      while (last < depths.size() && depths[last] <= limit) ++last;
      const float depth = depths[first + (last - first) / 2];
      const auto& warped = group_.project(rays_.point(x, y, depth));
      std::size_t contradicting = 0;
      for (std::size_t i = 0; i < warped.size(); ++i)
        contradicting += warps_[i].sees_through(warped[i]) ? 1 : 0;
      if (contradicting < last - first) return depth;
      first = last;
    }
    return 0.0F;
  }

  // Blends what the sources show of the point projected last.
  std::optional<Blend> blended() {
    const auto& warped = group_.warped();
    const auto& weights = group_.weights_nearby();
    samples_.clear();
    for (std::size_t i = 0; i < warped.size(); ++i) {
      const SourceWarp& warp = warps_[i];
      if (!warp.shows(warped[i])) continue;
      const float weight = number_of(weights, i) * (warped[i].is_measured ? 1.0F : kCompletedWeight);
      samples_.add({warp.colour(warped[i].pixel), weight, warp.age()});
    }
    if (samples_.all().empty()) return std::nullopt;
    const bool all_agree = samples_.all_agree();
    const ColourSample typical = all_agree ? samples_.all().front() : samples_.consensus();
    cv::Vec3f colour;
    float age = 0.0F, sum = 0.0F, agreeing = 0.0F, all = 0.0F;
    for (const ColourSample& sample : samples_.all()) {
      all += sample.weight;
      if (!all_agree && !samples_.agree(sample, typical)) continue;
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

  const PixelRays& rays_;
  const std::vector<SourceWarp>& warps_;
  WarpedDepths depths_;
  WarpGroup group_;
  ColourSamples samples_;
  std::vector<float> sorted_;  // scratch
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
  PixelFiller filler(rays_, chosen, options_, area);
  for (int y = box.y; y < box.br().y; ++y)
    for (int x = box.x; x < box.br().x; ++x)
      if (area.at<std::uint8_t>(y, x) != 0) filler.fill(x, y, result);
  return result;
}

}  // namespace roslam
