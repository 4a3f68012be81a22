// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/loop_closing/closed_loop.hpp"
#include "roslam/loop_closing/essential_graph.hpp"
#include "roslam/loop_closing/global_bundle.hpp"
#include "roslam/loop_closing/loop_closing_options.hpp"
#include "roslam/loop_closing/loop_detector.hpp"
#include "roslam/loop_closing/pose_graph.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/mapping/fusion.hpp"
#include "roslam/place_recognition/keyframe_database.hpp"

namespace roslam {

/// Detects and closes loops, keyframe by keyframe: pose graph optimisation, fusion of duplicate landmarks,
/// global bundle adjustment (Mur-Artal and Tardos, T-RO 2017, section III). If the keyframes are of two
/// submaps, the newer submap is aligned with the older one and merged into it instead of the pose graph step.
class LoopCloser {
 public:
  struct Settings {
    LoopDetectorOptions detector;
    LoopCloserOptions closer;
    PoseGraphOptions pose_graph;
    GeometricVerifier::Settings place;
    FusionOptions fusion;
    BundleAdjustmentOptions bundle;
  };

  /// map_mutex guards map and database against the tracker and the mapper. Throws OptionsError.
  LoopCloser(const Camera& camera, Map& map, KeyframeDatabase& database, MapMutex& map_mutex,
             const Settings& settings);

  /// Adds a keyframe to the database and closes the loop that it confirms, if it does. Slow when it does;
  /// takes the mutex for the parts that touch the map. should_stop ends global bundle adjustment early.
  /// is_cancelled ends the pose graph as well, and discards its loop.
  void process(KeyframeId keyframe, const std::function<bool()>& should_stop = {},
               const std::function<bool()>& is_cancelled = {});

  /// Global bundle adjustment, as after a loop. Takes the mutex for the parts that touch the map.
  void adjust_all(const std::function<bool()>& should_stop = {});

  const std::vector<ClosedLoop>& closed() const { return closed_; }
  std::size_t refused() const { return refused_; }  ///< loops whose error stayed above max_error

  /// Seconds the last process() spent in each step, for the report.
  struct Times {
    double recognise = 0.0;
    double correct = 0.0;
    double fuse = 0.0;
    double bundle = 0.0;
  };
  const Times& times() const { return times_; }

 private:
  std::optional<DetectedLoop> recognise(KeyframeId keyframe);
  bool correct_loop(const DetectedLoop& loop, const std::function<bool()>& is_cancelled);
  bool merge_submaps(const DetectedLoop& loop);
  void note(const DetectedLoop& loop, const SE3& T_camera_old, bool merges_submaps);
  void fuse(const DetectedLoop& loop);

  Camera camera_;
  Map& map_;
  KeyframeDatabase& keyframe_database_;
  MapMutex& map_mutex_;
  Settings settings_;
  LoopDetector detector_;
  std::vector<ClosedLoop> closed_;
  std::size_t refused_ = 0;
  Times times_;
};

}  // namespace roslam
