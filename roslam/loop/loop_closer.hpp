// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/loop/essential_graph.hpp"
#include "roslam/loop/global_bundle.hpp"
#include "roslam/loop/loop_detector.hpp"
#include "roslam/loop/pose_graph.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/mapping/fusion.hpp"
#include "roslam/places/place_index.hpp"

namespace roslam {

struct LoopCloserOptions {
  int min_shared = 100;        ///< landmarks that make a pair of keyframes an edge of the essential graph
  double max_error = 4.0;      ///< sigmas that may be left of a loop once the map has taken it up
  int bundle_iterations = 10;  ///< of global bundle adjustment; 0: none

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// A loop that was closed.
struct ClosedLoop {
  KeyframeId keyframe;
  KeyframeId place;
  double moved = 0.0;   ///< metres by which the newer keyframe was corrected
  double turned = 0.0;  ///< radians
  int matches = 0;      ///< landmarks it was recognised by
  bool joins = false;   ///< two worlds became one by it
};

/// Finds loops keyframe by keyframe and takes the drift out of the map: pose graph, fusion of what is there
/// twice, global bundle adjustment (Mur-Artal and Tardos, T-RO 2017, section III). Where the place is of
/// another world, the newer of the two moves to where it belongs and they become one.
class LoopCloser {
 public:
  struct Settings {
    LoopDetectorOptions detector;
    LoopCloserOptions closer;
    PoseGraphOptions pose_graph;
    PlaceCheck::Settings place;
    FusionOptions fusion;
    BundleAdjustmentOptions bundle;
  };

  /// map_mutex guards map and places against the tracker and the mapper.
  LoopCloser(const Camera& camera, Map& map, PlaceIndex& places, MapMutex& map_mutex,
             const Settings& settings);

  /// Puts a keyframe into the index and closes the loop it may show. Slow where it does; takes the mutex for
  /// the parts that touch the map. should_stop ends global bundle adjustment early.
  void process(KeyframeId keyframe, const std::function<bool()>& should_stop = {});

  /// Global bundle adjustment, as after a loop. Takes the mutex for the parts that touch the map.
  void adjust_all(const std::function<bool()>& should_stop = {});

  const std::vector<ClosedLoop>& closed() const { return closed_; }
  std::size_t refused() const { return refused_; }  ///< loops that would have bent the map too much

  /// Seconds the last process() spent in each step, for the report.
  struct Times {
    double recognise = 0.0;
    double correct = 0.0;
    double fuse = 0.0;
    double bundle = 0.0;
  };
  const Times& times() const { return times_; }

 private:
  std::optional<Loop> recognise(KeyframeId keyframe);
  bool straighten(const Loop& loop);
  bool join_worlds(const Loop& loop);
  void note(const Loop& loop, const SE3& T_camera_old, bool joins);
  void fuse(const Loop& loop);

  Camera camera_;
  Map& map_;
  PlaceIndex& places_;
  MapMutex& map_mutex_;
  Settings settings_;
  LoopDetector detector_;
  std::vector<ClosedLoop> closed_;
  std::size_t refused_ = 0;
  Times times_;
};

}  // namespace roslam
