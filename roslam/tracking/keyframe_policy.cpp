// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/keyframe_policy.hpp"

#include <algorithm>

#include "roslam/error.hpp"

namespace roslam {

namespace {
int landmarks_of(const Map& map, KeyframeId id) {
  const Keyframe* keyframe = map.find(id);
  if (keyframe == nullptr) return 0;
  return static_cast<int>(std::count_if(keyframe->landmarks.begin(), keyframe->landmarks.end(),
                                        [](LandmarkId landmark) { return landmark.is_valid(); }));
}
}  // namespace

void KeyframePolicyOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("keyframes.") + message);
  };
  require(max_interval > 0.0, "max_interval must be positive (seconds)");
  require(min_interval >= 0.0 && min_interval <= max_interval,
          "min_interval must be 0 to max_interval (seconds)");
  require(min_overlap > 0.0 && min_overlap < 1.0, "min_overlap must lie between 0 and 1");
  require(min_tracked_near >= 0, "min_tracked_near must not be negative");
  require(min_new_near >= 0, "min_new_near must not be negative");
  require(near > 0.0, "near must be positive (metres)");
}

KeyframePolicy::KeyframePolicy(const KeyframePolicyOptions& options) : options_(options) {
  options_.validate();
}

bool KeyframePolicy::promotes(const TrackedFrame& frame, const Map& map, bool mapper_idle) const {
  if (!options_.enabled || frame.state != TrackingState::kTracking) return false;
  if (!frame.reference.is_valid()) return true;  // a world begins
  const double elapsed = frame.timestamp - last_timestamp_;
  if (elapsed < options_.min_interval) return false;

  int tracked_near = 0;
  int new_near = 0;
  for (std::size_t i = 0; i < frame.landmarks.size(); ++i) {
    const float depth = frame.view->depths[i];
    if (depth <= 0.0F || depth > options_.near) continue;
    ++(frame.landmarks[i].is_valid() ? tracked_near : new_near);
  }
  const bool needs_near = tracked_near < options_.min_tracked_near && new_near > options_.min_new_near;
  // What something that moves hides for the moment is not a part of the scene that has not been mapped.
  const int reference = landmarks_of(map, frame.reference) - frame.hidden;
  const bool little_overlap = frame.inliers < options_.min_overlap * reference;
  const bool weak = frame.inliers < 0.25 * reference || needs_near;
  const bool due = elapsed >= options_.max_interval;
  return (due || mapper_idle || weak) && (little_overlap || needs_near);
}

}  // namespace roslam
