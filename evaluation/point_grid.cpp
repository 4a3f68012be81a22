// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/point_grid.hpp"

#include <algorithm>
#include <numeric>

namespace roslam::evaluation {

PointGrid::PointGrid(std::vector<Eigen::Vector3f> points, float reach)
    : order_(points.size()), reach_(reach) {
  std::vector<Key> keys(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    keys[i] = key(cell(points[i].x()), cell(points[i].y()), cell(points[i].z()));
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  std::stable_sort(order_.begin(), order_.end(),
                   [&](std::size_t a, std::size_t b) { return keys[a] < keys[b]; });
  points_.reserve(points.size());
  for (std::size_t i = 0; i < order_.size(); ++i) {
    points_.push_back(points[order_[i]]);
    const auto at = static_cast<std::uint32_t>(i);
    auto& range = cells_.try_emplace(keys[order_[i]], at, at).first->second;
    range.second = at + 1;
  }
}

std::optional<PointGrid::Found> PointGrid::nearest(const Eigen::Vector3f& point) const {
  const std::int64_t x = cell(point.x()), y = cell(point.y()), z = cell(point.z());
  float least = reach_ * reach_;
  std::optional<std::size_t> best;
  for (std::int64_t dz = -1; dz <= 1; ++dz) {
    for (std::int64_t dy = -1; dy <= 1; ++dy) {
      for (std::int64_t dx = -1; dx <= 1; ++dx) {
        const auto found = cells_.find(key(x + dx, y + dy, z + dz));
        if (found == cells_.end()) continue;
        for (std::uint32_t i = found->second.first; i < found->second.second; ++i) {
          const float squared = (points_[i] - point).squaredNorm();
          if (squared > least) continue;
          least = squared;
          best = i;
        }
      }
    }
  }
  if (!best) return std::nullopt;
  return Found{order_[*best], std::sqrt(least)};
}

}  // namespace roslam::evaluation
