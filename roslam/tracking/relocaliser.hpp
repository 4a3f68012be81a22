// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>

#include "roslam/map/map.hpp"
#include "roslam/tracking/place_check.hpp"

namespace roslam {

struct RelocaliserOptions {
  int candidates = 4;  ///< keyframes tried for one frame by looks, and as many by time
  int min_inliers =
      40;  ///< landmarks that must agree on the pose: a wrong place must not pass for the right one

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// Recovers the pose of a frame without knowing where the camera was.
class Relocaliser {
 public:
  Relocaliser(const RelocaliserOptions& options, PlaceCheck check)
      : options_(options), check_(std::move(check)) {}

  /// Tries the keyframes that look like the frame, best first, as many as options say; then the newest, as
  /// many; with search_all in place of these all keyframes, a few from call to call.
  std::optional<PlaceMatch> find(const Map& map, const ObservedFrame& frame,
                                 std::span<const KeyframeId> similar, bool search_all);

 private:
  RelocaliserOptions options_;
  PlaceCheck check_;
  std::size_t next_ = 0;  // how far search_all has come, counted from the newest keyframe
};

}  // namespace roslam
