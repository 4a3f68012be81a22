// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "roslam/common/export.hpp"

namespace roslam {

/// Grid index over the points of an image: finds those near a pixel.
class ROSLAM_EXPORT FeatureGrid {
 public:
  FeatureGrid() = default;

  /// bounds: {min_x, min_y, max_x, max_y} in pixels; points outside are kept in the border cells.
  FeatureGrid(std::span<const Eigen::Vector2f> points, const std::array<double, 4>& bounds);

  /// Appends to result the indices of the points whose x and y both lie within radius (pixels) of the centre.
  void find(const Eigen::Vector2f& centre, float radius, std::vector<std::uint32_t>& result) const;

  bool contains(const Eigen::Vector2f& pixel) const {
    return pixel.x() >= min_.x() && pixel.y() >= min_.y() && pixel.x() <= max_.x() && pixel.y() <= max_.y();
  }

 private:
  static constexpr int kColumns = 64;
  static constexpr int kRows = 48;
  int column(float x) const;
  int row(float y) const;

  Eigen::Vector2f min_ = Eigen::Vector2f::Zero();
  Eigen::Vector2f max_ = Eigen::Vector2f::Zero();
  Eigen::Vector2f cells_per_pixel_ = Eigen::Vector2f::Zero();
  std::vector<Eigen::Vector2f> points_;    // ordered by cell
  std::vector<std::uint32_t> indices_;     // original index of each entry of points_
  std::vector<std::uint32_t> cell_begin_;  // kColumns * kRows + 1 offsets into points_
};

}  // namespace roslam
