// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/matching/projection_matcher.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
// The ratio test. Two descriptors that both equal the query cannot be told apart either.
bool is_ambiguous(const NearestTwo& nearest, double ratio) {
  return nearest.second_distance == 0 || nearest.best_distance > ratio * nearest.second_distance;
}

constexpr float kMinViewCosine = 0.5F;  // 60 degrees: beyond that the appearance differs too much
}  // namespace

void MatcherOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("matcher.") + message);
  };
  require(max_distance >= 0 && max_distance <= kDescriptorBits, "max_distance must be 0 to 256 bits");
  require(strict_distance >= 0 && strict_distance <= kDescriptorBits,
          "strict_distance must be 0 to 256 bits");
  require(ratio > 0.0 && ratio <= 1.0, "ratio must be above 0 and at most 1");
  require(frame_radius > 0.0 && frame_radius < 1000.0, "frame_radius must be 0 to 1000 pixels");
  require(map_radius > 0.0 && map_radius < 1000.0, "map_radius must be 0 to 1000 pixels");
  require(fuse_radius > 0.0 && fuse_radius < 1000.0, "fuse_radius must be 0 to 1000 pixels");
  require(depth_tolerance > 0.0, "depth_tolerance must be positive");
}

std::optional<Prediction> predict(const Landmark& landmark, const Map& map, const ObservedFrame& frame,
                                  const Camera& camera, const SE3& T_camera_world) {
  const Eigen::Vector3d point = T_camera_world * landmark.position;
  if (point.z() <= 0.0) return std::nullopt;
  const Eigen::Vector2f pixel = camera.project(point).cast<float>();
  if (!frame.grid.contains(pixel)) return std::nullopt;
  const double distance = point.norm();
  if (distance < landmark.min_distance || distance > landmark.max_distance) return std::nullopt;
  const Eigen::Vector3d to_camera = -(T_camera_world.rotation().conjugate() * point) / distance;
  const auto cosine = static_cast<float>(to_camera.dot(landmark.normal));
  if (cosine < kMinViewCosine) return std::nullopt;
  return Prediction{pixel, static_cast<float>(point.z()), map.predict_level(landmark, distance), cosine};
}

// Whether the depth of a point is not that of the query. That of stereo may be far less certain than the
// tolerance.
bool ProjectionMatcher::is_elsewhere(const Query& query, const ObservedFrame& frame, std::size_t point) const {
  const float depth = frame.depths[point];
  if (!(query.depth > 0.0F && depth > 0.0F)) return false;
  constexpr float kSigmas = 3.0F;
  const auto tolerance = static_cast<float>(options_.depth_tolerance);
  const float sigma = frame.inverse_depth_sigma(point);
  if (sigma > 0.0F)
    return std::abs(1.0F / depth - 1.0F / query.depth) > tolerance / query.depth + kSigmas * sigma;
  return std::abs(depth - query.depth) > tolerance * query.depth;
}

int ProjectionMatcher::find(const Query& query, const Descriptor& descriptor, const ObservedFrame& frame,
                            const std::vector<LandmarkId>& taken) {
  nearby_.clear();
  candidates_.clear();
  frame.grid.find(query.pixel, query.radius, nearby_);
  for (const std::uint32_t i : nearby_) {
    if (frame.levels[i] < query.min_level || frame.levels[i] > query.max_level || taken[i].is_valid())
      continue;
    if (is_elsewhere(query, frame, i)) continue;
    candidates_.push_back(i);
  }
  const NearestTwo nearest = nearest_two(descriptor, frame.descriptors, candidates_);
  if (nearest.best < 0 || nearest.best_distance > query.max_distance) return -1;
  if (query.use_ratio && nearest.second >= 0) {
    const auto best = static_cast<std::size_t>(nearest.best);
    const auto second = static_cast<std::size_t>(nearest.second);
    if (frame.levels[best] == frame.levels[second] && is_ambiguous(nearest, options_.ratio)) {
      return -1;
    }
  }
  return nearest.best;
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> match_descriptors(const ObservedFrame& a,
                                                                       const std::vector<std::uint32_t>& from,
                                                                       const ObservedFrame& b,
                                                                       const MatcherOptions& options) {
  std::vector<int> owner(b.size(), -1);  // position in `from` of the match of each point of b
  std::vector<int> owner_distance(b.size(), kDescriptorBits + 1);
  for (std::size_t i = 0; i < from.size(); ++i) {
    const NearestTwo nearest = nearest_two(a.descriptors[from[i]], b.descriptors);
    if (nearest.best < 0 || nearest.best_distance > options.strict_distance) continue;
    if (nearest.second >= 0 && is_ambiguous(nearest, options.ratio)) continue;
    const auto best = static_cast<std::size_t>(nearest.best);
    if (nearest.best_distance >= owner_distance[best]) continue;
    owner[best] = static_cast<int>(i);
    owner_distance[best] = nearest.best_distance;
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t j = 0; j < owner.size(); ++j) {
    if (owner[j] >= 0) pairs.emplace_back(from[static_cast<std::size_t>(owner[j])], j);
  }
  return pairs;
}

std::vector<bool> consistent_rotation(const std::vector<float>& angle_differences) {
  constexpr int kBins = 30;
  constexpr int kKeptBins = 3;
  std::array<int, kBins> histogram{};
  const auto bin_of = [](float degrees) {
    const float turn = degrees / 360.0F;
    return static_cast<std::size_t>((turn - std::floor(turn)) * kBins) % kBins;
  };
  for (const float difference : angle_differences) ++histogram[bin_of(difference)];
  std::array<std::size_t, kBins> order{};
  std::iota(order.begin(), order.end(), 0U);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return histogram[a] > histogram[b]; });
  std::array<bool, kBins> keep{};
  for (int k = 0; k < kKeptBins; ++k) {
    const auto bin = order[static_cast<std::size_t>(k)];
    keep[bin] = 10 * histogram[bin] >= histogram[order[0]];
  }
  std::vector<bool> result;
  for (const float difference : angle_differences) result.push_back(keep[bin_of(difference)]);
  return result;
}

}  // namespace roslam
