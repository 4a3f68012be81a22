// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/occupancy/occupancy_grid.hpp"

#include "roslam/occupancy/occupancy_content.hpp"

namespace roslam {

namespace {
constexpr double kFarthest = 1e6;  // cells from the origin

Eigen::Vector3i first_cell(const BlockKey& key) { return kBlockSide * Eigen::Vector3i(key.x, key.y, key.z); }
}  // namespace

OccupancyState OccupancyGrid::at(const Eigen::Vector3d& point) const {
  const Eigen::Array3d scaled = (point / content_->resolution).array().floor();
  if (!(scaled.abs() < kFarthest).all()) return OccupancyState::kUnknown;  // or not a number
  const Eigen::Vector3i cell = scaled.matrix().cast<int>();
  const auto found = content_->blocks.find(block_of(cell));
  return found == content_->blocks.end() ? OccupancyState::kUnknown : (*found->second)[index_of(cell)];
}

double OccupancyGrid::resolution() const { return content_->resolution; }
SubmapId OccupancyGrid::submap() const { return content_->submap; }
std::size_t OccupancyGrid::keyframes() const { return content_->keyframes; }
double OccupancyGrid::timestamp() const { return content_->timestamp; }

void OccupancyGrid::visit(const Visitor& visitor) const {
  for (const auto& [key, cells] : content_->blocks) visitor({first_cell(key), *cells});
}

void OccupancyGrid::visit_changed(const OccupancyGrid& earlier, const Visitor& visitor) const {
  if (earlier.submap() != submap() || earlier.resolution() != resolution()) return visit(visitor);
  const auto& before = earlier.content_->blocks;
  for (const auto& [key, cells] : content_->blocks) {
    const auto found = before.find(key);
    if (found == before.end() || found->second != cells) visitor({first_cell(key), *cells});
  }
  static constexpr Content::Cells kUnknown{};
  for (const auto& [key, cells] : before) {
    if (!content_->blocks.contains(key)) visitor({first_cell(key), kUnknown});
  }
}

}  // namespace roslam
