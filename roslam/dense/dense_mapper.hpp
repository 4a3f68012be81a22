// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "roslam/dense/dense_options.hpp"
#include "roslam/dense/depth_keyframe.hpp"
#include "roslam/dense/surface_map.hpp"
#include "roslam/dense/tsdf_volume.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/map/keyframe_pose.hpp"

namespace roslam {

/// How a dense map changed.
struct DenseChanges {
  struct Moved {
    KeyframeId id;
    KeyframePose before, now;                 ///< without a submap: it was not in, or is not any more
    std::optional<PackedDepthKeyframe> gone;  ///< the keyframe, if the map does not have it any more
  };
  std::vector<Moved> keyframes;
  std::map<SubmapId, BlockSet> blocks;  ///< of voxels
  bool is_all = false;                  ///< all there is, as if nothing had been there before
};

/// Fuses keyframes into a TSDF volume for each submap and follows pose corrections: blocks affected by moved
/// keyframes are erased and re-integrated, so that the map equals one fused at the corrected poses. Not
/// thread-safe.
class DenseMapper {
 public:
  /// Throws OptionsError.
  DenseMapper(const DenseOptions& options, const MeasurementNoise& noise);

  /// Fuses a keyframe that was not inserted before. Ignored if it has no depth, its pose is not finite or it
  /// has no submap.
  void insert(KeyframeId id, const DepthKeyframe& keyframe, const KeyframePose& pose);

  /// Re-integrates keyframes at their corrected poses. Those that moved by less than share times
  /// DenseOptions::follow voxels stay; those without a submap were withdrawn and leave the map. Returns the
  /// number of keyframes that moved or left. should_stop: polled once a keyframe; blocks that it keeps from
  /// being re-integrated stay as they were and are left to the next call.
  std::size_t follow(const std::map<KeyframeId, KeyframePose>& poses, double share = 1.0,
                     const std::function<bool()>& should_stop = {});

  /// Ids of the fused keyframes, ascending.
  std::vector<KeyframeId> keyframes() const;

  /// Null if the submap has no fused keyframes.
  const TsdfVolume* map(SubmapId submap) const;

  /// The surface of a submap, without points that fail the VisibilityCheck. Empty if nothing was fused.
  SurfaceMap surface(SubmapId submap) const;

  /// The same; nothing if should_stop, which is polled once a keyframe, became true.
  std::optional<SurfaceMap> surface(SubmapId submap, const std::function<bool()>& should_stop) const;

  /// Visits the fused keyframes of a submap in the order of their ids, with the poses they were fused at.
  void visit(SubmapId submap,
             const std::function<void(const DepthKeyframe&, const SE3& T_world_camera)>& visitor) const;

  /// What changed since the last call; all, in the first and after the voxels became larger. Costs the mapper
  /// time from the first call on.
  DenseChanges take_changes();

  /// A keyframe of such changes, before the next change of the map.
  DepthKeyframe keyframe(const DenseChanges::Moved& moved) const {
    return unpack(moved.gone ? *moved.gone : fused_.at(moved.id).keyframe);
  }

  /// Makes the next call give all.
  void restart_changes() { changes_ = {}; }

  double voxel_size() const { return voxel_size_; }       ///< metres; 0 before the first keyframe
  std::size_t voxel_bytes() const;                        ///< of all submaps
  std::size_t view_bytes() const { return view_bytes_; }  ///< of keyframes kept for re-integration
  int times_coarsened() const { return times_coarsened_; }

 private:
  struct Fused {
    PackedDepthKeyframe keyframe;
    KeyframePose pose;  // at which it was fused
    double depth;       // metres, median of the keyframe
  };

  TsdfVolume& map_of(SubmapId submap);
  bool has_moved(const Fused& fused, const KeyframePose& pose, double share) const;
  std::size_t note_moved(const std::map<KeyframeId, KeyframePose>& poses, double share);
  void withdraw(KeyframeId id);
  bool reintegrate(SubmapId submap, const BlockSet& blocks, const std::function<bool()>& should_stop);
  bool is_in_reach(const Fused& fused, const TsdfVolume& map, const BlockSet& blocks) const;
  void limit_memory();
  DenseChanges all() const;

  // What take_changes() has not given yet.
  struct Changes {
    std::map<KeyframeId, KeyframePose> before;  // without a submap: new
    std::map<KeyframeId, Fused> gone;
    std::map<SubmapId, BlockSet> blocks;
    bool are_kept = false;  // false: all changed
  };

  DenseOptions options_;
  MeasurementNoise noise_;
  double voxel_size_;
  std::map<KeyframeId, Fused> fused_;
  std::map<SubmapId, TsdfVolume> maps_;
  std::map<SubmapId, BlockSet> stale_;  // to be re-integrated
  std::size_t view_bytes_ = 0;
  int times_coarsened_ = 0;
  Changes changes_;
};

}  // namespace roslam
