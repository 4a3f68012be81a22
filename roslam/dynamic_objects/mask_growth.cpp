// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/mask_growth.hpp"

#include <array>
#include <cmath>
#include <deque>

namespace roslam {

namespace {
bool is_continuous(float a, float b) {
  constexpr float kStep = 0.03F;  // metres
  constexpr float kShareOfDepth = 0.015F;
  return std::abs(a - b) < kStep + kShareOfDepth * std::min(a, b);
}
}  // namespace

void grow_masks(cv::Mat& owners, const GrowthField& field, const CellGrid& grid, double max_metres) {
  struct Front {
    cv::Point cell;
    float travelled;
  };
  std::deque<Front> open;
  for (int y = 0; y < owners.rows; ++y) {
    for (int x = 0; x < owners.cols; ++x) {
      const bool is_seed = owners.at<int>(y, x) != 0 && field.seeds.at<std::uint8_t>(y, x) != 0;
      if (is_seed && field.depth.at<float>(y, x) > 0.0F) open.push_back({{x, y}, 0.0F});
    }
  }
  constexpr std::array<std::array<int, 2>, 4> kNeighbours{{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
  const auto limit = static_cast<float>(max_metres);
  while (!open.empty()) {
    const Front front = open.front();
    open.pop_front();
    const float z = field.depth.at<float>(front.cell);
    for (const auto& [dx, dy] : kNeighbours) {
      const cv::Point q(front.cell.x + dx, front.cell.y + dy);
      if (q.x < 0 || q.y < 0 || q.x >= owners.cols || q.y >= owners.rows || owners.at<int>(q) != 0) continue;
      const float z_next = field.depth.at<float>(q);
      if (z_next <= 0.0F || field.barrier.at<std::uint8_t>(q) != 0 || !is_continuous(z, z_next)) continue;
      const bool moves = field.moving.at<std::uint8_t>(q) != 0;
      const float travelled = moves ? front.travelled : front.travelled + grid.side_at(z);
      if (travelled > limit) continue;
      owners.at<int>(q) = owners.at<int>(front.cell);
      // Steps without cost first, as in 0-1 breadth-first search, so that paths are shortest.
      moves ? open.push_front({q, travelled}) : open.push_back({q, travelled});
    }
  }
}

}  // namespace roslam
