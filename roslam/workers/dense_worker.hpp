// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <stop_token>

#include "roslam/common/stage_times.hpp"
#include "roslam/dense/dense_map.hpp"
#include "roslam/dense/live_surface.hpp"
#include "roslam/dynamic_objects/dynamic_objects.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/map/keyframe_pose.hpp"
#include "roslam/occupancy/occupancy_grid.hpp"
#include "roslam/options/options.hpp"
#include "roslam/restoration/restored_image.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/workers/load_control.hpp"

namespace roslam {

/// A keyframe as the dense map takes it.
struct DenseInput {
  Frame frame;  ///< as taken; its images must not be changed afterwards
  DynamicObjects dynamic_objects;
  cv::Mat labels;                         ///< of this frame or an earlier one, CV_8UC1; empty: none are known
  SE3 T_labelled_camera;                  ///< from the keyframe's camera to the camera that the labels are of
  std::optional<DepthNoise> depth_noise;  ///< of the camera, if known
  bool has_older_labels = false;          ///< the labels are of an earlier frame
  bool is_restored = false;               ///< comes in two parts: restored() tells of the second
};

/// Fuses keyframes into a dense map as they come, on a thread of its own at lower priority: the tracker never
/// waits, and a failure costs a keyframe and nothing else. In deterministic mode each is fused at once.
class DenseWorker {
 public:
  /// pose_lookup: called on the worker's thread. load: null, or what may make it wait. Throws
  /// CalibrationError, OptionsError, or OptionsError naming the component where the library was built without
  /// it.
  DenseWorker(const Camera& camera, const Options& options, Mode mode, PoseLookup pose_lookup,
              LoadControl* load = nullptr);
  ~DenseWorker();

  void submit(KeyframeId keyframe, DenseInput input);

  /// The restored image of a keyframe that waits for it; null: there is none, the keyframe is fused with its
  /// holes.
  void restored(KeyframeId keyframe, const RestoredImage* image);

  /// The map was corrected as a whole: the dense map follows with the next keyframe. May be called from any
  /// thread.
  void follow_soon();

  /// Waits until all are fused and the map has followed the keyframes to their final poses; without the
  /// latter once cancelled.
  void drain();

  /// Discards the keyframes that wait.
  void cancel();

  /// The occupancy of the submap of the keyframe that was fused last, kept up from the first call on; null
  /// before the next keyframe. May be called from any thread.
  std::shared_ptr<const OccupancyGrid> occupancy();

  /// What changed in the surfaces since that revision of that submap, for displays; kept up from one keyframe
  /// to the next while somebody asks. May be called from any thread.
  SurfaceChanges surface_changes(SubmapId submap, std::uint64_t revision, std::size_t most_points);

  /// The map that the call before asked for, made when the next keyframe was fused, and asks for one of this
  /// submap; null if it is not made yet or none was asked for. Without occupancy. May be called from any
  /// thread.
  std::shared_ptr<const DenseMap> checkpoint(SubmapId submap);

  /// The map as it is. Only after drain(). Nothing if a stop was requested before it was extracted.
  std::optional<DenseMap> result(SubmapId submap, const std::stop_token& stop = {}) const;

  StageTimes times() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace roslam
