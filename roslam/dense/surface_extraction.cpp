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
constexpr std::uint32_t kNone = 0xffffffffU;
constexpr float kMargin = 0.02F;  // voxels, distance of the surface from voxels, so that no triangle is flat
constexpr float kDeepest = 2.5F;  // voxels, largest depth behind the surface at a cut edge

// The corners of a cube of voxels: bit 0 is x, bit 1 is y, bit 2 is z.
using Corners = std::array<const Voxel*, 8>;
Eigen::Vector3i offset(unsigned corner) {
  return Eigen::Vector3<unsigned>(corner & 1U, corner >> 1U & 1U, corner >> 2U & 1U).cast<int>();
}

// A value for each edge of a cube. An edge is four times its axis, plus 1 on the upper side along the next
// axis (u), plus 2 on that along the one after (v).
using Edges = std::array<std::uint32_t, 12>;
constexpr unsigned next(unsigned axis) { return (axis + 1U) % 3U; }
constexpr unsigned edge_of(unsigned axis, unsigned u, unsigned v) { return 4U * axis + u + 2U * v; }
constexpr unsigned start_of(unsigned edge) {  // its first corner
  return (edge & 1U) << next(edge / 4U) | (edge >> 1U & 1U) << next(next(edge / 4U));
}
constexpr unsigned end_of(unsigned edge) { return start_of(edge) | 1U << edge / 4U; }

bool is_free(const Voxel* voxel) { return voxel != nullptr && voxel->distance() > 0.0F; }

class SurfaceNets {
 public:
  SurfaceNets(const TsdfVolume& map, const DenseOptions& options)
      : map_(map), options_(options), deepest_(kDeepest * map.voxel_size() / map.truncation()) {}

  SurfaceMap run() {
    surface_.spacing = static_cast<double>(map_.voxel_size());
    visit(&SurfaceNets::add_points);
    visit(&SurfaceNets::add_squares);
    align_normals();
    return std::move(surface_);
  }

 private:
  using Index =
      Eigen::Vector3i;  // of a voxel or a cube's first voxel, counted from the visited block's first
  using Triangle = std::array<std::uint32_t, 3>;

  void visit(void (SurfaceNets::*add)(const Index&)) {
    for (const BlockKey& key : map_.keys()) {
      key_ = key;
      for (int i = 0; i < 27; ++i)
        blocks_[static_cast<std::size_t>(i)] =
            map_.find({key.x + i % 3 - 1, key.y + i / 3 % 3 - 1, key.z + i / 9 - 1});
      for (int i = 0; i < kBlockVoxels; ++i) (this->*add)({i & 7, i >> 3 & 7, i >> 6});
    }
  }

  // Null if the voxel is not known.
  const Voxel* voxel(const Index& at) const {
    static_assert(kBlockSide == 8);
    const int block = 13 + (at.x() >> 3) + 3 * (at.y() >> 3) + 9 * (at.z() >> 3);
    const Block* b = blocks_[static_cast<std::size_t>(block)];
    if (b == nullptr) return nullptr;
    const Voxel& voxel = b->voxels[Block::index(at.x() & 7, at.y() & 7, at.z() & 7)];
    return voxel.is_known() ? &voxel : nullptr;
  }

  // An index from the world origin.
  BlockKey global(const Index& at) const {
    return {kBlockSide * key_.x + at.x(), kBlockSide * key_.y + at.y(), kBlockSide * key_.z + at.z()};
  }

  // The points of a cube, one for each patch of surface.
  void add_points(const Index& at) {
    Corners corners;
    for (unsigned i = 0; i < 8; ++i) {
      corners[i] = voxel(at + offset(i));
      if (corners[i] == nullptr) return;
    }
    const auto free = std::count_if(corners.begin(), corners.end(), is_free);
    if (free == 0 || free == 8) return;
    auto point = point_in(corners);
    if (!point) return;
    const Edges patches = patches_of(at, corners);
    Edges& points = points_[global(at)];
    points.fill(kNone);
    for (unsigned patch = 0; patch < 12; ++patch) {
      const auto position = patches[patch] == patch ? crossing(corners, patches, patch) : std::nullopt;
      if (!position) continue;
      for (std::size_t edge = 0; edge < 12; ++edge)
        if (patches[edge] == patch) points[edge] = static_cast<std::uint32_t>(surface_.points.size());
      point->position = map_.centre(key_, at.x(), at.y(), at.z()) + *position * map_.voxel_size();
      surface_.points.push_back(*point);
    }
  }

  // Joins the cut edges of a cube over its faces to patches, named by one of their edges. If all edges of a
  // face are cut, what is behind the surface is joined, unless both cubes at the face join its free corners
  // elsewhere: then four squares would share an edge of the mesh. Both cubes decide alike.
  Edges patches_of(const Index& at, const Corners& corners) const {
    Edges patches;
    for (unsigned i = 0; i < 12; ++i)
      patches[i] = is_free(corners[start_of(i)]) != is_free(corners[end_of(i)]) ? i : kNone;
    const auto is_cut = [&](unsigned edge) { return patches[edge] != kNone; };
    for (unsigned face = 0; face < 6; ++face) {
      const unsigned axis = face / 2U, up = face % 2U, u = next(axis), v = next(u), first = up << axis;
      // In order; edge k is from corner k to the next one.
      const std::array around{first, first | 1U << u, first | 1U << u | 1U << v, first | 1U << v};
      const std::array edges{edge_of(u, 0, up), edge_of(v, up, 1), edge_of(u, 1, up), edge_of(v, up, 0)};
      const auto joins_free = [&](int step) {
        int behind = 0;
        return std::all_of(around.begin(), around.end(), [&](unsigned i) {
          return is_free(voxel(at + offset(i) + step * Index::Unit(axis))) ||
                 (!is_free(corners[i]) && ++behind < 2);
        });
      };
      const bool is_ambiguous = std::all_of(edges.begin(), edges.end(), is_cut);
      const bool is_free_joined = is_ambiguous && joins_free(-1) && joins_free(1);
      for (unsigned k = 0; k < 4; ++k) {
        const unsigned before = edges[(k + 3U) % 4U], other = is_cut(before) ? before : edges[(k + 2U) % 4U];
        if (!is_cut(edges[k]) || !is_cut(other)) continue;
        if (is_ambiguous && is_free(corners[around[k]]) == is_free_joined) continue;
        const unsigned joined = patches[edges[k]], patch = patches[other];
        std::replace(patches.begin(), patches.end(), joined, patch);
      }
    }
    return patches;
  }

  // What the points of a cube have in common; nothing if they are not to be in the map.
  std::optional<SurfacePoint> point_in(const Corners& corners) const {
    float weight = 0.0F;
    for (const Voxel* corner : corners) weight += corner->weight();
    const Voxel& nearest = **std::ranges::min_element(
        corners, {}, [](const Voxel* corner) { return std::abs(corner->distance()); });
    const bool is_seen = nearest.provenance() != Provenance::kInpainted;
    if (is_seen && weight < 8.0F * static_cast<float>(options_.min_weight)) return std::nullopt;
    if (!options_.keep_movable && movable_of(nearest.label()) != Movable::kNone) return std::nullopt;
    return SurfacePoint{Eigen::Vector3f::Zero(), gradient(corners), colour(corners), nearest.label(),
                        nearest.provenance()};
  }

  // The mean of a patch's edge crossings, in voxels from the first corner; nothing if an edge ends deep
  // behind the surface, as at occlusion edges.
  std::optional<Eigen::Vector3f> crossing(const Corners& corners, const Edges& patches,
                                          unsigned patch) const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (unsigned edge = 0; edge < 12; ++edge) {
      if (patches[edge] != patch) continue;
      const float a = corners[start_of(edge)]->distance(), b = corners[end_of(edge)]->distance();
      if (std::min(a, b) < -deepest_) return std::nullopt;
      // Clamped, because a free voxel tells less of the surface's position than one behind it.
      const float before = std::min(std::max(a, b), deepest_), behind = -std::min(a, b);
      const float way = std::clamp(behind / (before + behind), kMargin, 1.0F - kMargin);
      sum += offset(start_of(edge)).cast<float>();
      sum[edge / 4U] += a > 0.0F ? 1.0F - way : way;
    }
    return sum / static_cast<float>(std::count(patches.begin(), patches.end(), patch));
  }

  // The direction in which the distance, clamped as in crossing(), grows.
  Eigen::Vector3f gradient(const Corners& corners) const {
    Eigen::Vector3f result = Eigen::Vector3f::Zero();
    for (unsigned i = 0; i < 8; ++i)
      result += std::clamp(corners[i]->distance(), -deepest_, deepest_) *
                (2 * offset(i) - Eigen::Vector3i::Ones()).cast<float>();
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

  // The squares around the three edges that begin at a voxel.
  void add_squares(const Index& at) {
    const Voxel* here = voxel(at);
    for (unsigned axis = 0; axis < 3 && here != nullptr; ++axis) {
      const Voxel* there = voxel(at + Index::Unit(axis));
      if (there == nullptr || is_free(here) == is_free(there)) continue;
      // The points of the four cubes around the edge, in order.
      std::array<std::uint32_t, 4> corners{};
      for (unsigned i = 0; i < 4; ++i) {
        const unsigned u = i == 0 || i == 3 ? 1 : 0, v = i < 2 ? 1 : 0, edge = edge_of(axis, u, v);
        const auto found = points_.find(global(at - offset(start_of(edge))));
        corners[i] = found == points_.end() ? kNone : found->second[edge];
      }
      if (std::find(corners.begin(), corners.end(), kNone) != corners.end()) continue;
      if (is_free(here)) std::swap(corners[1], corners[3]);
      const auto is_folded = [&](const Triangle& t) { return is_free(here) == (area(t)[axis] > 0.0F); };
      // A square that is not convex faces free space with both halves along one diagonal only.
      if (is_folded({corners[0], corners[1], corners[2]}) || is_folded({corners[0], corners[2], corners[3]}))
        std::rotate(corners.begin(), corners.begin() + 1, corners.end());
      surface_.triangles.push_back({corners[0], corners[1], corners[2]});
      surface_.triangles.push_back({corners[0], corners[2], corners[3]});
    }
  }

  // Twice the area of a triangle, along its normal.
  Eigen::Vector3f area(const Triangle& t) const {
    const Eigen::Vector3f& first = surface_.points[t[0]].position;
    return (surface_.points[t[1]].position - first).cross(surface_.points[t[2]].position - first);
  }

  // Turns the normals that a triangle contradicts, by little. The triangle is right: its free side follows
  // from the signs of two voxels, the normals from differences of noisy distances.
  void align_normals() {
    constexpr int kPasses = 20;
    constexpr float kLeast = 0.05F, kAim = 0.2F;  // sums of the cosines at the corners
    const auto contradicts = [&](const Triangle& t) {
      const Eigen::Vector3f normal = area(t).normalized();
      float sum = 0.0F;
      for (const std::uint32_t i : t) sum += normal.dot(surface_.points[i].normal);
      if (sum > kLeast) return false;
      for (const std::uint32_t i : t)
        surface_.points[i].normal = (surface_.points[i].normal + (kAim - sum) / 3.0F * normal).normalized();
      return true;
    };
    std::vector<Triangle>& all = surface_.triangles;
    for (int pass = 0; pass < kPasses; ++pass)
      if (std::count_if(all.begin(), all.end(), contradicts) == 0) return;
    while (std::erase_if(all, contradicts) > 0) continue;
  }

  const TsdfVolume& map_;
  const DenseOptions& options_;
  float deepest_;
  BlockKey key_;                                              // of the visited block
  std::array<const Block*, 27> blocks_{};                     // the visited block and its neighbours
  std::unordered_map<BlockKey, Edges, BlockKeyHash> points_;  // of the patches, by global() index of the cube
  SurfaceMap surface_;
};
}  // namespace

SurfaceMap extract_surface(const TsdfVolume& map, const DenseOptions& options) {
  return SurfaceNets(map, options).run();
}

}  // namespace roslam
