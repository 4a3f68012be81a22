// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <vector>

#include "roslam/cloud/dense_options.hpp"
#include "roslam/cloud/dense_view.hpp"
#include "roslam/cloud/surface.hpp"
#include "roslam/cloud/voxel_map.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/map/keyframe_place.hpp"

namespace roslam {

/// Fuses keyframes into a dense map for each world, and follows when they move: what they touched is fused
/// anew, so that the map is as if all had been fused where they are by now. Not safe to call from several
/// threads at once.
class DenseMapper {
 public:
  /// Throws OptionsError.
  DenseMapper(const DenseOptions& options, const MeasurementNoise& noise);

  /// Adds a keyframe that was not added before. A view without depth, or a pose that is not finite, adds
  /// nothing.
  void insert(KeyframeId id, const DenseView& view, const KeyframePlace& place);

  /// Moves keyframes to where they are by now; those that moved by less than a share of a voxel
  /// (DenseOptions::follow, times share) stay. Returns how many moved.
  std::size_t follow(const std::map<KeyframeId, KeyframePlace>& places, double share = 1.0);

  /// The keyframes that were added, with the places that they were fused at.
  std::vector<KeyframeId> keyframes() const;

  /// Null if nothing was fused in that world.
  const VoxelMap* map(WorldId world) const;

  /// The surfaces of a world, less what other views look through. Empty if nothing was fused there.
  Surface surface(WorldId world) const;

  /// Hands out the views that were fused in a world, in the order of their keyframes, and where.
  void visit(WorldId world,
             const std::function<void(const DenseView&, const SE3& T_world_camera)>& visitor) const;

  double voxel_size() const { return voxel_size_; }       ///< metres; 0 before the first view
  std::size_t voxel_bytes() const;                        ///< of all worlds
  std::size_t view_bytes() const { return view_bytes_; }  ///< of views that are kept to be fused anew
  int times_coarsened() const { return times_coarsened_; }

 private:
  struct Fused {
    PackedView view;
    KeyframePlace place;
    double depth;  // metres, typical of the view
  };

  VoxelMap& map_of(WorldId world);
  bool has_moved(const Fused& fused, const KeyframePlace& place, double share) const;
  void fuse_again(WorldId world, const BlockSet& blocks);
  bool may_reach(const Fused& fused, const VoxelMap& map, const BlockSet& blocks) const;
  void limit_memory();

  DenseOptions options_;
  MeasurementNoise noise_;
  double voxel_size_;
  std::map<KeyframeId, Fused> fused_;
  std::map<WorldId, VoxelMap> maps_;
  std::size_t view_bytes_ = 0;
  int times_coarsened_ = 0;
};

}  // namespace roslam
