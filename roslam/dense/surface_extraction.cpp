// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/surface_map.hpp"
#include "roslam/dense/tsdf_volume.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "roslam/semantics/label_set.hpp"

namespace roslam {

namespace {
constexpr std::uint32_t kNoPoint = 0xffffffffU;
constexpr float kDeepest = 2.5F;  // voxels, largest depth behind the surface at a cut edge

// The corners of a cube of voxels: bit 0 is x, bit 1 is y, bit 2 is z.
using Corners = std::array<const Voxel*, 8>;

class SurfaceNets {
 public:
  SurfaceNets(const TsdfVolume& map, const DenseOptions& options)
      : map_(map), options_(options), deepest_(kDeepest * map.voxel_size() / map.truncation()) {}

  SurfaceMap run() {
    surface_.spacing = static_cast<double>(map_.voxel_size());
    const std::vector<BlockKey> keys = map_.keys();
    for (const BlockKey& key : keys) add_points(key);
    for (const BlockKey& key : keys) add_triangles(key);
    return std::move(surface_);
  }

 private:
  using PointIndices = std::array<std::uint32_t, kBlockVoxels>;

  // The block of a key and its upper neighbours, cached for voxel look-ups.
  class Neighbours {
   public:
    Neighbours(const TsdfVolume& map, const BlockKey& key) {
      for (int i = 0; i < 8; ++i)
        blocks_[static_cast<std::size_t>(i)] =
            map.find({key.x + (i & 1), key.y + (i >> 1 & 1), key.z + (i >> 2 & 1)});
    }
    const Voxel* voxel(int x, int y, int z) const {
      const int block = x / kBlockSide + 2 * (y / kBlockSide) + 4 * (z / kBlockSide);
      const Block* b = blocks_[static_cast<std::size_t>(block)];
      return b == nullptr ? nullptr
                          : &b->voxels[Block::index(x % kBlockSide, y % kBlockSide, z % kBlockSide)];
    }

   private:
    std::array<const Block*, 8> blocks_{};
  };

  void add_points(const BlockKey& key) {
    const Neighbours blocks(map_, key);
    PointIndices* indices = nullptr;
    for (int z = 0; z < kBlockSide; ++z) {
      for (int y = 0; y < kBlockSide; ++y) {
        for (int x = 0; x < kBlockSide; ++x) {
          Corners corners;
          for (int i = 0; i < 8; ++i)
            corners[static_cast<std::size_t>(i)] =
                blocks.voxel(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2 & 1));
          const auto point = point_in(corners);
          if (!point) continue;
          if (indices == nullptr) {
            indices = &point_indices_[key];
            indices->fill(kNoPoint);
          }
          (*indices)[Block::index(x, y, z)] = static_cast<std::uint32_t>(surface_.points.size());
          surface_.points.push_back(*point);
          surface_.points.back().position = map_.centre(key, x, y, z) + point->position * map_.voxel_size();
        }
      }
    }
  }

  // The surface point of a cube, in voxels from its first corner; nothing if no surface crosses it.
  std::optional<SurfacePoint> point_in(const Corners& corners) const {
    float least = 2.0F, most = -2.0F, weight = 0.0F;
    for (const Voxel* corner : corners) {
      if (corner == nullptr || !corner->is_known()) return std::nullopt;
      least = std::min(least, corner->distance());
      most = std::max(most, corner->distance());
      weight += corner->weight();
    }
    if (least > 0.0F || most <= 0.0F) return std::nullopt;
    const Voxel* nearest = *std::min_element(
        corners.begin(), corners.end(),
        [](const Voxel* a, const Voxel* b) { return std::abs(a->distance()) < std::abs(b->distance()); });
    SurfacePoint point;
    point.provenance = nearest->provenance();
    if (point.provenance != Provenance::kInpainted && weight < 8.0F * static_cast<float>(options_.min_weight))
      return std::nullopt;
    point.label = nearest->label();
    if (!options_.keep_movable && movable_of(point.label) != Movable::kNone) return std::nullopt;
    const auto position = crossing(corners);
    if (!position) return std::nullopt;
    point.position = *position;
    point.normal = gradient(corners);
    point.colour = colour(corners);
    return point;
  }

  // The mean of the edge crossings; nothing if an edge ends deep behind the surface, as at occlusion edges.
  std::optional<Eigen::Vector3f> crossing(const Corners& corners) const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int count = 0;
    for (unsigned i = 0; i < 8; ++i) {
      for (unsigned axis = 0; axis < 3; ++axis) {
        const unsigned j = i | 1U << axis;
        if (j == i) continue;
        const float a = corners[i]->distance(), b = corners[j]->distance();
        if ((a > 0.0F) == (b > 0.0F)) continue;
        if (std::min(a, b) < -deepest_) return std::nullopt;
        Eigen::Vector3f at(static_cast<float>(i & 1U), static_cast<float>(i >> 1 & 1U),
                           static_cast<float>(i >> 2 & 1U));
        // Clamped, because a free voxel tells less of the surface's position than one behind it.
        const float before = std::min(std::max(a, b), deepest_), behind = -std::min(a, b);
        const float way = std::min(behind / (before + behind), 1.0F);
        at[axis] = a > 0.0F ? 1.0F - way : way;
        sum += at;
        ++count;
      }
    }
    return sum / static_cast<float>(count);
  }

  static Eigen::Vector3f gradient(const Corners& corners) {
    Eigen::Vector3f result = Eigen::Vector3f::Zero();
    for (unsigned i = 0; i < 8; ++i)
      for (unsigned axis = 0; axis < 3; ++axis)
        result[axis] += (i >> axis & 1U) != 0 ? corners[i]->distance() : -corners[i]->distance();
    const float norm = result.norm();
    return norm > 0.0F ? Eigen::Vector3f(result / norm) : Eigen::Vector3f::UnitZ();
  }

  static cv::Vec3b colour(const Corners& corners) {
    cv::Vec3f sum;
    float all = 0.0F;
    for (const Voxel* corner : corners) {
      const float share = std::max(0.0F, 1.0F - std::abs(corner->distance())) * corner->weight() + 1e-6F;
      sum += share * corner->colour();
      all += share;
    }
    return {cv::saturate_cast<std::uint8_t>(sum[0] / all), cv::saturate_cast<std::uint8_t>(sum[1] / all),
            cv::saturate_cast<std::uint8_t>(sum[2] / all)};
  }

  // The point of a cube by its voxel coordinates in a block; -1 is in the block before.
  std::uint32_t point_at(const BlockKey& key, int x, int y, int z) const {
    const auto block = [](int i) { return i < 0 ? -1 : 0; };
    const auto rest = [&](int i) { return i - block(i) * kBlockSide; };
    const auto found = point_indices_.find({key.x + block(x), key.y + block(y), key.z + block(z)});
    return found == point_indices_.end() ? kNoPoint : found->second[Block::index(rest(x), rest(y), rest(z))];
  }

  void add_triangles(const BlockKey& key) {
    const Neighbours blocks(map_, key);
    for (int z = 0; z < kBlockSide; ++z)
      for (int y = 0; y < kBlockSide; ++y)
        for (int x = 0; x < kBlockSide; ++x) add_squares(key, blocks, {x, y, z});
  }

  // The squares around the three edges that begin at a voxel.
  void add_squares(const BlockKey& key, const Neighbours& blocks, const std::array<int, 3>& at) {
    const Voxel* here = blocks.voxel(at[0], at[1], at[2]);
    if (here == nullptr || !here->is_known()) return;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::array<int, 3> next = at;
      ++next[axis];
      const Voxel* there = blocks.voxel(next[0], next[1], next[2]);
      if (there == nullptr || !there->is_known()) continue;
      const bool is_free_here = here->distance() > 0.0F;
      if (is_free_here == (there->distance() > 0.0F)) continue;
      // The four cubes around the edge, in order.
      const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
      std::array<std::uint32_t, 4> corners{};
      for (std::size_t i = 0; i < 4; ++i) {
        std::array<int, 3> cube = at;
        if (i == 0 || i == 3) --cube[u];
        if (i == 0 || i == 1) --cube[v];
        corners[i] = point_at(key, cube[0], cube[1], cube[2]);
      }
      if (std::find(corners.begin(), corners.end(), kNoPoint) != corners.end()) continue;
      if (is_free_here) std::swap(corners[1], corners[3]);
      surface_.triangles.push_back({corners[0], corners[1], corners[2]});
      surface_.triangles.push_back({corners[0], corners[2], corners[3]});
    }
  }

  const TsdfVolume& map_;
  const DenseOptions& options_;
  float deepest_;
  std::unordered_map<BlockKey, PointIndices, BlockKeyHash> point_indices_;  // of cubes, by block
  SurfaceMap surface_;
};
}  // namespace

SurfaceMap extract_surface(const TsdfVolume& map, const DenseOptions& options) {
  return SurfaceNets(map, options).run();
}

}  // namespace roslam
