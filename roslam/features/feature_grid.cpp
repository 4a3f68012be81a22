// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/features/feature_grid.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

FeatureGrid::FeatureGrid(std::span<const Eigen::Vector2f> points, const std::array<double, 4>& bounds)
    : min_(static_cast<float>(bounds[0]), static_cast<float>(bounds[1])),
      max_(static_cast<float>(bounds[2]), static_cast<float>(bounds[3])),
      cells_per_pixel_(kColumns / (max_.x() - min_.x()), kRows / (max_.y() - min_.y())),
      points_(points.size()),
      indices_(points.size()),
      cell_begin_(kColumns * kRows + 1, 0) {
  std::vector<std::uint32_t> cell_of(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    cell_of[i] = static_cast<std::uint32_t>(row(points[i].y()) * kColumns + column(points[i].x()));
    ++cell_begin_[cell_of[i] + 1];
  }
  for (std::size_t c = 1; c < cell_begin_.size(); ++c) cell_begin_[c] += cell_begin_[c - 1];
  std::vector<std::uint32_t> fill(cell_begin_.begin(), cell_begin_.end() - 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t slot = fill[cell_of[i]]++;
    points_[slot] = points[i];
    indices_[slot] = static_cast<std::uint32_t>(i);
  }
}

int FeatureGrid::column(float x) const {
  // Clamped before the cast, as a pixel may lie outside the range of int.
  return static_cast<int>(std::clamp((x - min_.x()) * cells_per_pixel_.x(), 0.0F, kColumns - 1.0F));
}

int FeatureGrid::row(float y) const {
  return static_cast<int>(std::clamp((y - min_.y()) * cells_per_pixel_.y(), 0.0F, kRows - 1.0F));
}

void FeatureGrid::find(const Eigen::Vector2f& centre, float radius,
                       std::vector<std::uint32_t>& result) const {
  if (points_.empty()) return;
  const int first_column = column(centre.x() - radius);
  const int last_column = column(centre.x() + radius);
  const int last_row = row(centre.y() + radius);
  for (int r = row(centre.y() - radius); r <= last_row; ++r) {
    const auto row_begin = static_cast<std::size_t>(r * kColumns);
    const std::uint32_t begin = cell_begin_[row_begin + static_cast<std::size_t>(first_column)];
    const std::uint32_t end = cell_begin_[row_begin + static_cast<std::size_t>(last_column) + 1];
    for (std::uint32_t slot = begin; slot < end; ++slot) {
      const Eigen::Vector2f offset = points_[slot] - centre;
      if (std::abs(offset.x()) <= radius && std::abs(offset.y()) <= radius) result.push_back(indices_[slot]);
    }
  }
}

}  // namespace roslam
