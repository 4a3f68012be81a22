// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/live_surface.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "roslam/dense/dense_mapper.hpp"
#include "roslam/dense/dense_options.hpp"
#include "roslam/dense/tsdf_volume.hpp"

namespace roslam {

namespace {
using Clock = std::chrono::steady_clock;
constexpr auto kPatience = std::chrono::seconds(10);  // after the last call of since()
constexpr float kNear = 0.7F;                         // voxels from the surface

bool is_shown(const Voxel& voxel, const DenseOptions& options, float near) {
  if (!voxel.is_known() || std::abs(voxel.distance()) > near) return false;
  if (voxel.provenance() != Provenance::kInpainted && voxel.weight() < static_cast<float>(options.min_weight))
    return false;
  return options.keep_movable || movable_of(voxel.label()) == Movable::kNone;
}

// The direction in which the distance grows, by differences between neighbours in the block; zero if there
// are none.
Eigen::Vector3f gradient(const Block& block, int x, int y, int z) {
  const std::array<int, 3> at{x, y, z};
  Eigen::Vector3f result = Eigen::Vector3f::Zero();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto neighbour = [&](int step) -> const Voxel& {
      std::array<int, 3> there = at;
      there[axis] = std::clamp(at[axis] + step, 0, kBlockSide - 1);
      const Voxel& voxel = block.voxels[Block::index(there[0], there[1], there[2])];
      return voxel.is_known() ? voxel : block.voxels[Block::index(x, y, z)];
    };
    const Voxel &below = neighbour(-1), &above = neighbour(1), &here = neighbour(0);
    const int steps = (&below != &here ? 1 : 0) + (&above != &here ? 1 : 0);
    if (steps > 0)
      result[static_cast<Eigen::Index>(axis)] =
          (above.distance() - below.distance()) / static_cast<float>(steps);
  }
  const float norm = result.norm();
  return norm > 0.0F ? Eigen::Vector3f(result / norm) : result;
}

// Voxels at the surface, moved onto it.
std::shared_ptr<const SurfaceBlock> surface_in(const TsdfVolume* volume, const BlockKey& key,
                                               const DenseOptions& options) {
  auto result = std::make_shared<SurfaceBlock>();
  result->index = {key.x, key.y, key.z};
  const Block* block = volume != nullptr ? volume->find(key) : nullptr;
  if (block == nullptr) return result;
  const float voxels_per_truncation = volume->truncation() / volume->voxel_size();
  for (int i = 0; i < kBlockVoxels; ++i) {
    const Voxel& voxel = block->voxels[static_cast<std::size_t>(i)];
    if (!is_shown(voxel, options, kNear / voxels_per_truncation)) continue;
    const int x = i & 7, y = i >> 3 & 7, z = i >> 6;
    const Eigen::Vector3f place = Eigen::Vector3i(x, y, z).cast<float>() + Eigen::Vector3f::Constant(0.5F) -
                                  gradient(*block, x, y, z) * voxel.distance() * voxels_per_truncation;
    SurfaceBlock::Point point;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const float part = place[static_cast<Eigen::Index>(axis)] * (256.0F / kBlockSide);
      point.position[axis] = cv::saturate_cast<std::uint8_t>(std::floor(part));
    }
    const cv::Vec3f colour = voxel.colour();
    for (int c = 0; c < 3; ++c) point.colour[c] = cv::saturate_cast<std::uint8_t>(colour[c]);
    result->points.push_back(point);
  }
  return result;
}
}  // namespace

void LiveSurface::update(const DenseMapper& mapper, const DenseChanges& changes, const DenseOptions& options,
                         SubmapId current) {
  if (mapper.voxel_size() == 0.0) return;
  {
    const std::scoped_lock lock(mutex_);
    side_ = kBlockSide * mapper.voxel_size();
    if (changes.is_all) surfaces_.clear();
    if (changes.is_all || current != current_) begin_ = ++revision_;
    if (current != current_) renew(surfaces_[current]);
    current_ = current;
  }
  for (const auto& [submap, keys] : changes.blocks) {
    for (const BlockKey& key : keys) {
      auto block = surface_in(mapper.map(submap), key, options);
      const std::scoped_lock lock(mutex_);
      put(surfaces_[submap], std::move(block));
    }
  }
}

// Its blocks count as changed, in the same order.
void LiveSurface::renew(Surface& surface) {
  for (const auto& [old, block] : std::exchange(surface.blocks, {})) {
    surface.revisions[block->index] = ++revision_;
    surface.blocks.emplace(revision_, block);
  }
}

void LiveSurface::put(Surface& surface, std::shared_ptr<const SurfaceBlock> block) {
  const auto known = surface.revisions.find(block->index);
  if (known == surface.revisions.end() && block->points.empty()) return;
  if (known != surface.revisions.end()) surface.blocks.erase(known->second);
  surface.revisions[block->index] = ++revision_;
  surface.blocks.emplace(revision_, std::move(block));
}

SurfaceChanges LiveSurface::since(SubmapId submap, std::uint64_t revision, std::size_t most_points) {
  const std::scoped_lock lock(mutex_);
  wanted_ = Clock::now();
  was_wanted_ = true;
  SurfaceChanges result;
  result.submap = current_;
  result.side = side_;
  result.is_all = submap != current_ || revision < begin_ || revision > revision_;
  result.revision = result.is_all ? begin_ : revision;
  const auto surface = surfaces_.find(current_);
  if (surface == surfaces_.end()) return result;
  std::size_t points = 0;
  const auto& blocks = surface->second.blocks;
  for (auto i = result.is_all ? blocks.begin() : blocks.upper_bound(revision); i != blocks.end(); ++i) {
    const auto& [changed, block] = *i;
    if (points > 0 && points + block->points.size() > most_points) {
      result.has_more = true;
      return result;
    }
    points += block->points.size();
    result.blocks.push_back(block);
    result.revision = std::max(result.revision, changed);
  }
  return result;
}

bool LiveSurface::is_wanted() const {
  const std::scoped_lock lock(mutex_);
  return was_wanted_ && Clock::now() - wanted_ < kPatience;
}

bool LiveSurface::clear() {
  const std::scoped_lock lock(mutex_);
  if (surfaces_.empty()) return false;
  surfaces_.clear();
  begin_ = ++revision_;
  return true;
}

}  // namespace roslam
