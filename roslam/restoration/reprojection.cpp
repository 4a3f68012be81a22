// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/reprojection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>

#include "roslam/error.hpp"
#include "roslam/restoration/view_alignment.hpp"
#include "roslam/restoration/view_choice.hpp"

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
constexpr float kFewViews = 0.5F;     // sum of weights that counts for half of all there could be
constexpr float kGuessCounts = 0.3F;  // of a view whose depth is guessed

struct Surface {
  float depth = 0.0F;  // metres, 0 = none
  bool is_measured = false;
};

struct Blend {
  cv::Vec3f colour;
  float age = 0.0F;
  float certainty = 0.0F;
};

// What one view says about a pixel.
struct Opinion {
  cv::Vec3f colour;
  float weight;
  float age;
};

float difference(const cv::Vec3f& a, const cv::Vec3f& b) {
  return (std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2])) / 3.0F;
}

// Fills the pixels of one target.
class Filling {
 public:
  Filling(const PixelRays& rays, const std::vector<ViewLink>& links, const ReprojectionOptions& options,
          const cv::Rect& box)
      : rays_(rays),
        links_(links),
        options_(options),
        box_(box),
        measured_(links.size()),
        guessed_(links.size()) {
    for (std::size_t i = 0; i < links.size(); ++i) links[i].splat(box, measured_[i], guessed_[i]);
  }

  void fill(int x, int y, ReprojectedArea& area) {
    const Surface surface = surface_at(x, y);
    if (surface.depth == 0.0F) return;
    const auto blend = blend_at(rays_.point(x, y, surface.depth));
    if (!blend) return;
    area.filled.at<std::uint8_t>(y, x) = 255;
    area.colour.at<cv::Vec3b>(y, x) = blend->colour;
    area.depth.at<float>(y, x) = surface.is_measured ? surface.depth : 0.0F;
    area.age.at<float>(y, x) = blend->age;
    area.certainty.at<float>(y, x) = blend->certainty * (surface.is_measured ? 1.0F : kGuessCounts);
  }

 private:
  Surface surface_at(int x, int y) {
    if (const float depth = nearest_believed(gather(measured_, x, y), x, y); depth > 0.0F)
      return {depth, true};
    return {nearest_believed(gather(guessed_, x, y), x, y), false};
  }

  // The depths that views give a pixel, nearest first.
  const std::vector<float>& gather(const std::vector<cv::Mat>& splats, int x, int y) {
    depths_.clear();
    for (const cv::Mat& splat : splats)
      if (const float depth = splat.at<float>(y - box_.y, x - box_.x); depth > 0.0F) depths_.push_back(depth);
    std::sort(depths_.begin(), depths_.end());
    return depths_;
  }

  // Of the surfaces that views agree on the nearest that fewer of them look through than have it.
  float nearest_believed(const std::vector<float>& depths, int x, int y) const {
    for (std::size_t first = 0; first < depths.size();) {
      const float limit = depths[first] + 2.0F * links_.front().tolerance(depths[first]);
      std::size_t last = first;
      while (last < depths.size() && depths[last] <= limit) ++last;
      const float depth = depths[first + (last - first) / 2];
      const Eigen::Vector3f point = rays_.point(x, y, depth);
      const auto against =
          static_cast<std::size_t>(std::count_if(links_.begin(), links_.end(), [&](const ViewLink& link) {
            const auto sighting = link.look_at(point);
            return sighting && link.sees_through(*sighting);
          }));
      if (against < last - first) return depth;
      first = last;
    }
    return 0.0F;
  }

  std::optional<Blend> blend_at(const Eigen::Vector3f& point) {
    opinions_.clear();
    for (const ViewLink& link : links_) {
      const auto sighting = link.look_at(point);
      if (!sighting || !link.shows(*sighting)) continue;
      const float weight =
          link.weight(point, sighting->depth) * (sighting->is_measured ? 1.0F : kGuessCounts);
      opinions_.push_back({link.colour(sighting->pixel), weight, link.age()});
    }
    if (opinions_.empty()) return std::nullopt;
    const Opinion& typical = most_typical();
    cv::Vec3f colour;
    float age = 0.0F, sum = 0.0F, agreeing = 0.0F, all = 0.0F;
    for (const Opinion& opinion : opinions_) {
      all += opinion.weight;
      if (difference(opinion.colour, typical.colour) > options_.colour_tolerance) continue;
      // Blending blurs: of views about alike the best should make most of the picture.
      const float weight = opinion.weight * opinion.weight;
      colour += weight * opinion.colour;
      age += weight * opinion.age;
      sum += weight;
      agreeing += opinion.weight;
    }
    if (!(sum > 0.0F)) return std::nullopt;
    return Blend{colour / sum, age / sum, agreeing / all * agreeing / (agreeing + kFewViews)};
  }

  // The opinion that differs least from those of views from near by, or, if most of all views contradict
  // that, the one that differs least from all: a shadow or a thing that the removal missed stays for a while
  // where it is, but not for long.
  const Opinion& most_typical() const {
    const Opinion& of_near = least_different([](const Opinion& other) { return other.weight; });
    const float limit = 2.0F * static_cast<float>(options_.colour_tolerance);
    const auto agreeing = std::count_if(opinions_.begin(), opinions_.end(), [&](const Opinion& other) {
      return difference(of_near.colour, other.colour) <= limit;
    });
    if (2 * agreeing >= static_cast<std::ptrdiff_t>(opinions_.size())) return of_near;
    return least_different([](const Opinion&) { return 1.0F; });
  }

  template <typename Vote>
  const Opinion& least_different(const Vote& vote) const {
    const auto limit = 2.0F * static_cast<float>(options_.colour_tolerance);
    const Opinion* best = &opinions_.front();
    float least = std::numeric_limits<float>::max();
    for (const Opinion& one : opinions_) {
      float cost = 0.0F;
      for (const Opinion& other : opinions_)
        cost += vote(other) * std::min(difference(one.colour, other.colour), limit);
      if (cost < least) {
        least = cost;
        best = &one;
      }
    }
    return *best;
  }

  const PixelRays& rays_;
  const std::vector<ViewLink>& links_;
  const ReprojectionOptions& options_;
  cv::Rect box_;
  std::vector<cv::Mat> measured_, guessed_;
  std::vector<float> depths_;      // scratch
  std::vector<Opinion> opinions_;  // scratch
};
}  // namespace

std::vector<ViewLink> BackgroundReprojection::links(const View& target, const cv::Mat& area,
                                                    std::span<const SourceView* const> sources) const {
  std::vector<ViewLink> all;
  all.reserve(sources.size());
  const auto motion_to = [&](const SourceView& source) {
    return source.T_world_camera.inverse() * *target.T_world_camera;
  };
  for (const SourceView* source : sources)
    all.emplace_back(rays_, *source, motion_to(*source), target.timestamp, options_);
  cv::Mat known = target.depth.clone();
  if (!known.empty()) known.setTo(0, area);
  auto chosen = best_links(all, hidden_points(rays_, area, known), options_.views);
  const cv::Mat free = area == 0;
  const AlignmentPoints points(rays_, target, free);
  for (ViewLink& link : chosen) {
    if (options_.align)
      link = ViewLink(rays_, link.source(), points.aligned(link.source(), motion_to(link.source())),
                      target.timestamp, options_);
    link.match_light(target, free);
  }
  return chosen;
}

ReprojectedArea BackgroundReprojection::fill(const View& target, const cv::Mat& area,
                                             std::span<const SourceView* const> sources) const {
  const cv::Size size = target.colour.size();
  ReprojectedArea result{cv::Mat::zeros(size, CV_8UC1), cv::Mat::zeros(size, CV_8UC3),
                         cv::Mat::zeros(size, CV_32FC1), cv::Mat::zeros(size, CV_32FC1),
                         cv::Mat::zeros(size, CV_32FC1)};
  const cv::Rect box = cv::boundingRect(area);
  if (box.empty() || !target.T_world_camera) return result;
  const auto chosen = links(target, area, sources);
  if (chosen.empty()) return result;
  Filling filling(rays_, chosen, options_, box);
  for (int y = box.y; y < box.br().y; ++y)
    for (int x = box.x; x < box.br().x; ++x)
      if (area.at<std::uint8_t>(y, x) != 0) filling.fill(x, y, result);
  return result;
}

}  // namespace roslam
