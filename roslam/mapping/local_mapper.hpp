// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/mapping/bundle_adjustment.hpp"
#include "roslam/mapping/culling.hpp"
#include "roslam/mapping/fusion.hpp"
#include "roslam/mapping/new_landmarks.hpp"
#include "roslam/tracking/tracker.hpp"

namespace roslam {

/// Grows and refines the map, keyframe by keyframe.
class LocalMapper {
 public:
  struct Settings {
    NewLandmarkOptions landmarks;
    FusionOptions fusion;
    CullingOptions culling;
    BundleAdjustmentOptions bundle;
    MatcherOptions matcher;
    MeasurementNoise noise;
  };

  /// map_mutex guards the map against the tracker while process() runs on another thread.
  LocalMapper(const Camera& camera, Map& map, MapMutex& map_mutex, const Settings& settings);

  /// Makes a keyframe of a tracked frame, with landmarks for all points of known depth; of a new world if
  /// the frame has no reference. Quick; the caller holds the mutex.
  KeyframeId insert(const TrackedFrame& frame, std::size_t frame_index);

  /// Culls, triangulates, fuses and adjusts around a keyframe. Slow; takes the mutex for the parts that touch
  /// the map. should_stop ends bundle adjustment early, when the next keyframe waits.
  void process(KeyframeId keyframe, const std::function<bool()>& should_stop = {});

  /// Seconds the last process() spent in each step, for the report.
  struct Times {
    double landmarks = 0.0;
    double fusion = 0.0;
    double bundle = 0.0;
    double culling = 0.0;
  };
  const Times& times() const { return times_; }

 private:
  WorldId world_of(const TrackedFrame& frame);
  void adjust_around(KeyframeId keyframe, const std::function<bool()>& should_stop);

  Camera camera_;
  Map& map_;
  MapMutex& map_mutex_;
  Settings settings_;
  LandmarkCuller landmark_culler_;
  Times times_;
};

/// The part of a map that local bundle adjustment moves, and what holds it in place.
struct LocalBundle {
  BundleProblem problem;
  std::vector<KeyframeId> keyframes;  ///< of each pose
  std::vector<LandmarkId> landmarks;  ///< of each point

  /// The keyframe, the keyframes that share enough landmarks with it, all their landmarks, and as fixed poses
  /// the other keyframes that see those. The first keyframe of a world is always fixed.
  static LocalBundle around(const Map& map, KeyframeId keyframe, const MeasurementNoise& noise,
                            const BundleAdjustmentOptions& options);

  /// Takes the result over into the map and removes the observations that do not fit it. What was removed
  /// from the map meanwhile is left alone.
  void apply_to(Map& map, const Camera& camera) const;
};

}  // namespace roslam
