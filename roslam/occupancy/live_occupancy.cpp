// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/occupancy/live_occupancy.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "roslam/occupancy/occupancy_map.hpp"
#include "roslam/occupancy/ray_carving.hpp"

namespace roslam {

namespace {
void count(std::uint16_t& counter, int sign) {
  if (sign > 0 && counter < std::numeric_limits<std::uint16_t>::max()) ++counter;
  if (sign < 0 && counter > 0) --counter;
}
}  // namespace

void LiveOccupancy::update(const DenseMapper& mapper, const DenseChanges& changes) {
  if (mapper.voxel_size() == 0.0) return;
  if (changes.is_all) {
    resolution_ = usual_resolution(mapper.voxel_size());
    spaces_.clear();
  }
  for (const auto& moved : changes.keyframes) {
    const DepthKeyframe keyframe = mapper.keyframe(moved);  // one at a time, as they are large
    if (moved.before.submap.is_valid())
      see_through(spaces_[moved.before.submap], keyframe, moved.before.T_world_camera, -1);
    if (moved.now.submap.is_valid())
      see_through(spaces_[moved.now.submap], keyframe, moved.now.T_world_camera, 1);
  }
  for (const auto& [submap, blocks] : changes.blocks) {
    for (const BlockKey& key : blocks) find_surfaces(spaces_[submap], mapper.map(submap), key);
  }
}

void LiveOccupancy::see_through(Space& space, const DepthKeyframe& keyframe, const SE3& T_world_camera,
                                int sign) {
  space.keyframes =
      sign > 0 ? space.keyframes + 1 : space.keyframes - std::min<std::size_t>(space.keyframes, 1);
  for (const auto& [key, marks] : cells_seen_through(keyframe, T_world_camera, resolution_)) {
    Counts& counts = space.counts[key];
    space.touched.insert(key);
    for (std::size_t i = 0; i < counts.seen_through.size(); ++i) {
      if (marks.count(i & 7U, i >> 3U & 7U, i >> 6U, 1) > 0) count(counts.seen_through[i], sign);
    }
  }
}

// The cells of the voxels of a block that are at a surface, in place of those that were.
void LiveOccupancy::find_surfaces(Space& space, const TsdfVolume* voxels, const BlockKey& key) {
  const auto add = [&](const Eigen::Vector3i& cell, int sign) {
    const BlockKey block = block_of(cell);
    space.touched.insert(block);
    count(space.counts[block].surfaces[index_of(cell)], sign);
  };
  auto& cells = space.surface_cells[key];
  for (const Eigen::Vector3i& cell : cells) add(cell, -1);
  cells.clear();
  const Block* block = voxels != nullptr ? voxels->find(key) : nullptr;
  if (block == nullptr) {
    space.surface_cells.erase(key);
    return;
  }
  // Half a voxel's diagonal from the surface, in truncations.
  const float near = 0.87F * voxels->voxel_size() / voxels->truncation();
  for (int i = 0; i < kBlockVoxels; ++i) {
    const Voxel& voxel = block->voxels[static_cast<std::size_t>(i)];
    const bool is_surface =
        voxel.weight() >= static_cast<float>(options_.min_weight) && std::abs(voxel.distance()) <= near;
    Eigen::Vector3i cell;
    if (!is_surface) continue;
    const Eigen::Vector3f centre = voxels->centre(key, i & 7, i >> 3 & 7, i >> 6);
    if (find_cell(centre.cast<double>(), 1.0 / resolution_, cell)) cells.push_back(cell);
  }
  for (const Eigen::Vector3i& cell : cells) add(cell, 1);
}

std::shared_ptr<const OccupancyGrid> LiveOccupancy::grid(SubmapId submap, double timestamp) {
  const auto found = spaces_.find(submap);
  if (found == spaces_.end()) return nullptr;
  Space& space = found->second;
  auto content = std::make_shared<OccupancyGrid::Content>();
  if (space.last) content->blocks = space.last->blocks;
  content->resolution = resolution_;
  content->submap = submap;
  content->keyframes = space.keyframes;
  content->timestamp = timestamp;
  for (const BlockKey& key : space.touched) {
    const auto counts = space.counts.find(key);
    auto cells = std::make_shared<OccupancyGrid::Content::Cells>();
    bool is_known = false;
    for (std::size_t i = 0; i < cells->size(); ++i) {
      const bool is_occupied = counts->second.surfaces[i] > 0;
      (*cells)[i] = is_occupied                          ? OccupancyState::kOccupied
                    : counts->second.seen_through[i] > 0 ? OccupancyState::kFree
                                                         : OccupancyState::kUnknown;
      is_known |= (*cells)[i] != OccupancyState::kUnknown;
    }
    if (is_known) {
      content->blocks[key] = std::move(cells);
    } else {
      content->blocks.erase(key);
      space.counts.erase(counts);
    }
  }
  space.touched.clear();
  space.last = content;
  return std::make_shared<const OccupancyGrid>(content);
}

}  // namespace roslam
