// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "roslam/loop_closing/loop_closing_options.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/place_recognition/geometric_verifier.hpp"
#include "roslam/place_recognition/keyframe_database.hpp"

namespace roslam {

/// A keyframe that shows an older part of the map again.
struct DetectedLoop {
  KeyframeId keyframe;     ///< the newer keyframe
  SE3 T_keyframe_matched;  ///< from the camera frame of the matched keyframe to that of the newer one
  VerifiedMatch match;     ///< the matched (older) keyframe, and which of its landmarks the newer one shows
};

/// Detects loops: bag-of-words candidates that are not covisible with the keyframe, geometric verification,
/// a check that the implied drift is plausible, and temporal consistency over several keyframes. Perceptual
/// aliasing is common and a wrong loop ruins a map, so each step may reject.
class LoopDetector {
 public:
  LoopDetector(const LoopDetectorOptions& options, GeometricVerifier verifier);

  /// The loop that this keyframe confirms, if it does. The keyframe must be in the database. Takes the mutex,
  /// which guards map and database, for a few milliseconds at a time.
  std::optional<DetectedLoop> detect(const Map& map, const KeyframeDatabase& database, MapMutex& map_mutex,
                                     KeyframeId keyframe);

  /// Drops all loop hypotheses, as after a correction of the map.
  void reset() { hypotheses_.clear(); }

 private:
  // An unconfirmed loop. T_old_new maps world coordinates around the newer keyframes, which have drifted, to
  // those around the matched keyframes.
  struct LoopHypothesis {
    SE3 T_old_new;
    std::pair<SubmapId, SubmapId> submaps;  // of the newer and of the matched keyframe
    KeyframeId newest;                      // the last keyframe that agreed
    int count = 1;                          // keyframes that agreed
  };

  std::vector<KeyframeId> candidates(const Map& map, const KeyframeDatabase& database,
                                     KeyframeId keyframe) const;
  std::set<KeyframeId> surroundings(const Map& map, KeyframeId keyframe) const;
  bool is_plausible(const Map& map, KeyframeId keyframe, const VerifiedMatch& match) const;
  int support(const Map& map, KeyframeId keyframe, const VerifiedMatch& match);

  LoopDetectorOptions options_;
  GeometricVerifier verifier_;
  std::vector<LoopHypothesis> hypotheses_;
};

}  // namespace roslam
