// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/places/place_index.hpp"
#include "roslam/tracking/place_check.hpp"

namespace roslam {

struct LoopDetectorOptions {
  bool enabled = true;            ///< false: no place is recognised and no loop closed
  double min_similarity = 0.25;   ///< to a place, as a share of the similarity to the keyframe before
  int candidates = 3;             ///< places checked by geometry for one keyframe
  int min_inliers = 60;           ///< landmarks of a place that must agree on the pose
  int min_shared = 15;            ///< landmarks two keyframes share to count as neighbours
  int consistent = 3;             ///< keyframes that must recognise places in the same way
  int patience = 3;               ///< keyframes between two of these at most
  double tolerance = 0.1;         ///< metres by which they may differ
  double angle_tolerance = 0.02;  ///< radians by which they may differ
  double max_drift = 0.03;        ///< share of the path flown since that a loop may correct

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// A place that was left and came back to.
struct Loop {
  KeyframeId keyframe;   ///< the newer one
  SE3 T_keyframe_place;  ///< as recognised
  PlaceMatch match;      ///< what it shows of the older part of the map
};

/// Notices that a keyframe shows a place that its neighbours in the map do not know: candidates by words,
/// then by geometry, then by whether several keyframes agree and whether so much drift is plausible. Places
/// that look alike are common and a wrong loop ruins a map, so each step may say no.
class LoopDetector {
 public:
  LoopDetector(const LoopDetectorOptions& options, PlaceCheck check);

  /// The keyframe must be in the index. Nothing most of the time. Takes the mutex, which guards map and
  /// places, for a few milliseconds at a time.
  std::optional<Loop> detect(const Map& map, const PlaceIndex& places, MapMutex& map_mutex,
                             KeyframeId keyframe);

  /// Forgets what keyframes recognised so far, as after a correction of the map.
  void reset() { suspicions_.clear(); }

 private:
  // What recent keyframes recognised, as a motion of the world: where their part of the map should be moved.
  struct Suspicion {
    SE3 T_old_new;
    std::pair<WorldId, WorldId> worlds;  // of the keyframe and of the place
    KeyframeId newest;
    int count = 1;
  };

  std::vector<KeyframeId> candidates(const Map& map, const PlaceIndex& places, KeyframeId keyframe) const;
  std::set<KeyframeId> surroundings(const Map& map, KeyframeId keyframe) const;
  bool is_plausible(const Map& map, KeyframeId keyframe, const PlaceMatch& match) const;
  int support(const Map& map, KeyframeId keyframe, const PlaceMatch& match);

  LoopDetectorOptions options_;
  PlaceCheck check_;
  std::vector<Suspicion> suspicions_;
};

}  // namespace roslam
