// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/map/map.hpp"
#include "roslam/tracking/projection_matcher.hpp"

namespace roslam {

struct RelocaliserOptions {
  int min_matches = 15;    ///< matches with a keyframe that make it worth a pose estimate
  int min_inliers = 12;    ///< matches that must agree on a pose
  int candidates = 6;      ///< keyframes tried for one frame
  int iterations = 200;    ///< RANSAC samples for a keyframe, at most
  double max_error = 4.0;  ///< pixels a match may be off its reprojection

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// A pose found without knowing where the camera was.
struct RelocalisedPose {
  SE3 T_camera_world;
  std::vector<LandmarkId> landmarks;  ///< landmark each point of the frame shows, or none
  KeyframeId keyframe;                ///< the one that was recognised
};

/// The pose of a frame from descriptor matches with the landmarks of one keyframe: P3P in RANSAC. Nothing if
/// there are too few, or too few that agree.
std::optional<RelocalisedPose> recognise(const Map& map, const Keyframe& keyframe, const ObservedFrame& frame,
                                         const Camera& camera, const RelocaliserOptions& options,
                                         const MatcherOptions& matcher);

/// Recovers the pose of a frame without knowing where the camera was.
class Relocaliser {
 public:
  Relocaliser(const RelocaliserOptions& options, const MatcherOptions& matcher)
      : options_(options), matcher_(matcher) {}

  /// Tries the keyframes that look like the frame, best first, as many as options say; then the newest, as
  /// many; with search_all in place of these all keyframes, a few from call to call.
  std::optional<RelocalisedPose> find(const Map& map, const ObservedFrame& frame, const Camera& camera,
                                      std::span<const KeyframeId> similar, bool search_all);

 private:
  RelocaliserOptions options_;
  MatcherOptions matcher_;
  std::size_t next_ = 0;  // how far search_all has come, counted from the newest keyframe
};

}  // namespace roslam
