// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "roslam/estimation/measurement_model.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/mapping/bundle_adjustment.hpp"
#include "roslam/mapping/culling.hpp"
#include "roslam/mapping/fusion.hpp"
#include "roslam/mapping/new_landmarks.hpp"
#include "roslam/tracking/tracker.hpp"

namespace roslam {

/// Local mapping: extends and refines the map, keyframe by keyframe.
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

  /// Creates a keyframe from a tracked frame, and landmarks from its points of known depth; in a new submap
  /// if the frame has no reference. The caller holds the mutex.
  KeyframeId insert(const TrackedFrame& frame, std::size_t frame_index);

  /// Landmark culling, triangulation, fusion, local bundle adjustment and keyframe culling around a keyframe.
  /// Slow; takes the mutex for the parts that touch the map. should_stop ends bundle adjustment early.
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
  SubmapId submap_of(const TrackedFrame& frame);
  void adjust_around(KeyframeId keyframe, const std::function<bool()>& should_stop);

  Camera camera_;
  Map& map_;
  MapMutex& map_mutex_;
  Settings settings_;
  LandmarkCuller landmark_culler_;
  Times times_;
};

/// The part of a map that local bundle adjustment optimises, and the fixed poses that constrain it.
struct LocalBundle {
  BundleProblem problem;
  std::vector<KeyframeId> keyframes;  ///< of each pose
  std::vector<LandmarkId> landmarks;  ///< of each point

  /// The keyframe, the keyframes that share enough landmarks with it, all landmarks of these that two or more
  /// keyframes see, and as fixed poses the others that see them. The first keyframe of a submap is fixed.
  static LocalBundle around(const Map& map, KeyframeId keyframe, const MeasurementNoise& noise,
                            const BundleAdjustmentOptions& options);

  /// Writes the result to the map and removes outlier observations. Keyframes and landmarks that were removed
  /// from the map meanwhile are skipped. The caller holds the mutex.
  void apply_to(Map& map, const Camera& camera) const;
};

}  // namespace roslam
