// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cloud/surface.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "roslam/semantics/label_set.hpp"

namespace roslam {

namespace {
constexpr std::uint32_t kNoPoint = 0xffffffffU;
constexpr float kDeepest = 2.5F;  // voxels behind a surface that one beside it can be, at most

// The corners of a cube of voxels: bit 0 is x, bit 1 is y, bit 2 is z.
using Corners = std::array<const Voxel*, 8>;

class Extraction {
 public:
  Extraction(const VoxelMap& map, const DenseOptions& options)
      : map_(map), options_(options), deepest_(kDeepest * map.voxel_size() / map.truncation()) {}

  Surface run() {
    surface_.spacing = static_cast<double>(map_.voxel_size());
    const std::vector<BlockKey> keys = map_.keys();
    for (const BlockKey& key : keys) add_points(key);
    for (const BlockKey& key : keys) add_triangles(key);
    return std::move(surface_);
  }

 private:
  using Places = std::array<std::uint32_t, kBlockVoxels>;

  // Blocks about a key, to look voxels up without searching for each.
  class Neighbours {
   public:
    Neighbours(const VoxelMap& map, const BlockKey& key) {
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
    Places* places = nullptr;
    for (int z = 0; z < kBlockSide; ++z) {
      for (int y = 0; y < kBlockSide; ++y) {
        for (int x = 0; x < kBlockSide; ++x) {
          Corners corners;
          for (int i = 0; i < 8; ++i)
            corners[static_cast<std::size_t>(i)] =
                blocks.voxel(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2 & 1));
          const auto point = point_in(corners);
          if (!point) continue;
          if (places == nullptr) {
            places = &places_[key];
            places->fill(kNoPoint);
          }
          (*places)[Block::index(x, y, z)] = static_cast<std::uint32_t>(surface_.points.size());
          surface_.points.push_back(*point);
          surface_.points.back().position = map_.centre(key, x, y, z) + point->position * map_.voxel_size();
        }
      }
    }
  }

  // A point where a surface passes between the corners, at a place in voxels from the first one.
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
    if (point.provenance != Provenance::kInvented && weight < 8.0F * static_cast<float>(options_.min_weight))
      return std::nullopt;
    point.label = nearest->label();
    if (!options_.keep_movable && movable_of(point.label) != Movable::kNone) return std::nullopt;
    const auto position = crossing(corners);
    if (!position) return std::nullopt;
    point.position = *position;
    point.normal = slope(corners);
    point.colour = colour(corners);
    return point;
  }

  // The mean of where the surface cuts edges; nothing if it leaps to one deep inside, as where a surface
  // hides another.
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
        // What is free says less of where the surface is than what is behind it.
        const float before = std::min(std::max(a, b), deepest_), behind = -std::min(a, b);
        const float way = std::min(behind / (before + behind), 1.0F);
        at[axis] = a > 0.0F ? 1.0F - way : way;
        sum += at;
        ++count;
      }
    }
    return sum / static_cast<float>(count);
  }

  static Eigen::Vector3f slope(const Corners& corners) {
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

  // Of a cube by its place about a block; it may lie in one before it.
  std::uint32_t point_at(const BlockKey& key, int x, int y, int z) const {
    const auto block = [](int i) { return i < 0 ? -1 : 0; };
    const auto rest = [&](int i) { return i - block(i) * kBlockSide; };
    const auto found = places_.find({key.x + block(x), key.y + block(y), key.z + block(z)});
    return found == places_.end() ? kNoPoint : found->second[Block::index(rest(x), rest(y), rest(z))];
  }

  void add_triangles(const BlockKey& key) {
    const Neighbours blocks(map_, key);
    for (int z = 0; z < kBlockSide; ++z)
      for (int y = 0; y < kBlockSide; ++y)
        for (int x = 0; x < kBlockSide; ++x) add_squares(key, blocks, {x, y, z});
  }

  // About the three edges that begin at a voxel.
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
      // The cubes about the edge, around it.
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

  const VoxelMap& map_;
  const DenseOptions& options_;
  float deepest_;
  std::unordered_map<BlockKey, Places, BlockKeyHash> places_;
  Surface surface_;
};
}  // namespace

Surface extract_surface(const VoxelMap& map, const DenseOptions& options) {
  return Extraction(map, options).run();
}

Surface kept(const Surface& surface, const std::vector<bool>& keep) {
  Surface result;
  result.spacing = surface.spacing;
  std::vector<std::uint32_t> moved(surface.points.size(), kNoPoint);
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    if (!keep[i]) continue;
    moved[i] = static_cast<std::uint32_t>(result.points.size());
    result.points.push_back(surface.points[i]);
  }
  for (const auto& t : surface.triangles)
    if (keep[t[0]] && keep[t[1]] && keep[t[2]])
      result.triangles.push_back({moved[t[0]], moved[t[1]], moved[t[2]]});
  return result;
}

std::map<Provenance, std::size_t> count_by_provenance(const Surface& surface) {
  std::map<Provenance, std::size_t> points;
  for (const SurfacePoint& point : surface.points) ++points[point.provenance];
  return points;
}

Surface without_invented(const Surface& surface) {
  std::vector<bool> keep;
  keep.reserve(surface.points.size());
  for (const SurfacePoint& point : surface.points) keep.push_back(point.provenance != Provenance::kInvented);
  return kept(surface, keep);
}

}  // namespace roslam
