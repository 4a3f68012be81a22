// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/keyframe_policy.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "roslam/common/error.hpp"

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

bool KeyframePolicy::needs_keyframe(const TrackedFrame& frame, const Map& map, bool mapper_idle) const {
  if (!options_.enabled || frame.state != TrackingState::kTracking) return false;
  if (!frame.reference.is_valid()) return true;  // the first of a submap
  const double elapsed = frame.timestamp - last_timestamp_;
  if (elapsed < options_.min_interval) return false;

  constexpr float kNear = 0.1F;  // of the depth: what stereo measures so well is near whatever its distance
  const ObservedFrame& view = *frame.view;
  int tracked_near = 0;
  int new_near = 0;
  for (std::size_t i = 0; i < frame.landmarks.size(); ++i) {
    const bool is_near = view.inverse_depth_sigma(i) > 0.0F
                             ? view.has_depth(i, kNear)
                             : view.depths[i] > 0.0F && view.depths[i] <= options_.near;
    if (!is_near) continue;
    ++(frame.landmarks[i].is_valid() ? tracked_near : new_near);
  }
  const bool needs_near = tracked_near < options_.min_tracked_near && new_near > options_.min_new_near;
  // Landmarks that dynamic objects hide do not count as lost overlap.
  const int reference = landmarks_of(map, frame.reference) - frame.hidden;
  const bool little_overlap = frame.inliers < options_.min_overlap * reference;
  const bool weak = frame.inliers < 0.25 * reference || needs_near;
  const bool due = elapsed >= options_.max_interval;
  return (due || mapper_idle || weak) && (little_overlap || needs_near);
}

namespace {
// Calls visit(pixel, depth) for the landmarks of the frame's reference that project into the image.
template <typename Visit>
void for_each_in_view(const Map& map, const TrackedFrame& frame, const Camera& camera, const cv::Size& image,
                      const Visit& visit) {
  const Keyframe* reference = map.find(frame.reference);
  if (image.empty() || reference == nullptr || !frame.T_camera_world) return;
  for (const LandmarkId id : reference->landmarks) {
    const Landmark* landmark = map.find(id);
    if (landmark == nullptr) continue;
    const Eigen::Vector3d point = *frame.T_camera_world * landmark->position;
    if (point.z() <= 0.0) continue;
    const Eigen::Vector2d pixel = camera.distort(camera.project(point));
    const cv::Point at(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
    if (at.x >= 0 && at.y >= 0 && at.x < image.width && at.y < image.height) visit(at, point.z());
  }
}
}  // namespace

int count_hidden_landmarks(const Map& map, const TrackedFrame& frame, const Camera& camera,
                           const cv::Mat& mask) {
  int hidden = 0;
  for_each_in_view(map, frame, camera, mask.size(),
                   [&](const cv::Point& at, double) { hidden += mask.at<std::uint8_t>(at) != 0 ? 1 : 0; });
  return hidden;
}

LandmarksInView landmarks_on_objects(const Map& map, const TrackedFrame& frame, const Camera& camera,
                                     const cv::Mat& mask, const cv::Mat& depth) {
  constexpr double kSameDepth = 0.1;  // of the depth
  LandmarksInView landmarks;
  if (depth.size() != mask.size()) return landmarks;
  for_each_in_view(map, frame, camera, mask.size(), [&](const cv::Point& at, double z) {
    ++landmarks.all;
    const bool is_there = std::abs(depth.at<float>(at) - z) < kSameDepth * z;
    landmarks.on_objects += is_there && mask.at<std::uint8_t>(at) != 0 ? 1 : 0;
  });
  return landmarks;
}

}  // namespace roslam
