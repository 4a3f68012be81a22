// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/map/ids.hpp"

namespace roslam {

class DenseMapper;
struct DenseChanges;
struct DenseOptions;
class TsdfVolume;

/// Surfaces in one cube of space, as coloured points. Immutable.
struct ROSLAM_EXPORT SurfaceBlock {
  struct Point {
    std::array<std::uint8_t, 3> position{};  ///< in 256ths of the side, from the corner of least coordinates
    cv::Vec3b colour;                        ///< BGR
  };
  std::array<std::int32_t, 3> index{};  ///< of the cube: its corner in sides, from the origin of the world
  std::vector<Point> points;            ///< none: there is no surface any more
};

/// How the surfaces of the dense map changed, for displays. World frame of the submap.
struct ROSLAM_EXPORT SurfaceChanges {
  SubmapId submap;             ///< of the keyframe that was fused last; not valid before the first
  double side = 0.0;           ///< of a block, metres
  std::uint64_t revision = 0;  ///< to ask from the next time
  bool is_all = false;         ///< blocks that are not among these are gone, as when the voxels became larger
  bool has_more = false;       ///< more changed than was asked for
  std::vector<std::shared_ptr<const SurfaceBlock>> blocks;  ///< in the order of their changes
};

/// Keeps surfaces up with a dense map that grows, while somebody asks for them. A block depends on its own
/// voxels alone, so that what changed costs little; unlike SurfaceMap, points that fail the VisibilityCheck
/// are among them.
class LiveSurface {
 public:
  /// Takes over what changed in the dense map (DenseMapper::take_changes). current: the submap to show.
  void update(const DenseMapper& mapper, const DenseChanges& changes, const DenseOptions& options,
              SubmapId current);

  /// What changed since that revision of that submap; at most so many points, unless it is one block. May be
  /// called from any thread.
  SurfaceChanges since(SubmapId submap, std::uint64_t revision, std::size_t most_points);

  /// Whether since() was called in the last ten seconds. May be called from any thread.
  bool is_wanted() const;

  /// Forgets all until the next update. Returns whether there was anything.
  bool clear();

 private:
  using Index = std::array<std::int32_t, 3>;
  struct Surface {
    std::map<Index, std::uint64_t> revisions;
    std::map<std::uint64_t, std::shared_ptr<const SurfaceBlock>> blocks;  ///< by revision
  };

  void renew(Surface& surface);
  void put(Surface& surface, std::shared_ptr<const SurfaceBlock> block);

  mutable std::mutex mutex_;  // guards all
  std::map<SubmapId, Surface> surfaces_;
  SubmapId current_;
  double side_ = 0.0;
  std::uint64_t revision_ = 0;  // of the newest change; never falls
  std::uint64_t begin_ = 0;     // revision before the first of what there is now
  std::chrono::steady_clock::time_point wanted_;
  bool was_wanted_ = false;
};

}  // namespace roslam
