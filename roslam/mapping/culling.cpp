// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/mapping/culling.hpp"

#include <cmath>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
// True if enough other keyframes see the landmark at the same or a finer pyramid level (one coarser is
// tolerated).
bool is_well_seen(const Map& map, const Landmark& landmark, KeyframeId by, int level, int needed) {
  int views = 0;
  for (const auto& observation : landmark.observations) {
    if (observation.keyframe == by) continue;
    const Keyframe& other = *map.find(observation.keyframe);
    if (other.view->levels[observation.point] <= level + 1 && ++views >= needed) return true;
  }
  return false;
}

bool is_redundant(const Map& map, const Keyframe& keyframe, const CullingOptions& options) {
  int landmarks = 0;
  int well_seen = 0;
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const Landmark* landmark = map.find(keyframe.landmarks[i]);
    if (landmark == nullptr) continue;
    ++landmarks;
    if (is_well_seen(map, *landmark, keyframe.id, keyframe.view->levels[i], options.redundant_views))
      ++well_seen;
  }
  return well_seen > options.redundant_share * landmarks;
}

// True if the landmark projects onto a moving object at its depth, or if the frame sees through it.
bool is_contradicted(const Eigen::Vector3d& point, const Eigen::Vector2d& pixel, const Contradiction& frame,
                     const MeasurementNoise& noise) {
  constexpr int kAround = 2;  // pixels: depth is unreliable at object borders
  if (!pixel.allFinite()) return false;
  const cv::Point centre(cvRound(pixel.x()), cvRound(pixel.y()));
  if (centre.x < kAround || centre.y < kAround || centre.x + kAround >= frame.depth.cols ||
      centre.y + kAround >= frame.depth.rows) {
    return false;
  }
  const double tolerance = 3.0 * noise.sigma_of_depth(point.z()) + 0.02 * point.z();
  bool sees_through = true;
  for (int y = centre.y - kAround; y <= centre.y + kAround; ++y) {
    for (int x = centre.x - kAround; x <= centre.x + kAround; ++x) {
      const auto z = static_cast<double>(frame.depth.at<float>(y, x));
      sees_through = sees_through && z > point.z() + 2.0 * tolerance;
    }
  }
  if (sees_through) return true;
  const auto z = static_cast<double>(frame.depth.at<float>(centre));
  return !frame.moving.empty() && frame.moving.at<std::uint8_t>(centre) != 0 && z > 0.0 &&
         std::abs(z - point.z()) < tolerance;
}
}  // namespace

void CullingOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("culling.") + message);
  };
  require(min_found_ratio >= 0.0 && min_found_ratio <= 1.0, "min_found_ratio must be 0 to 1");
  require(probation >= 1, "probation must be at least 1 keyframe");
  require(min_observations >= 1, "min_observations must be at least 1");
  require(redundant_share > 0.0 && redundant_share <= 1.0, "redundant_share must be above 0 and at most 1");
  require(redundant_views >= 1, "redundant_views must be at least 1");
  require(keep_newest >= 1, "keep_newest must be at least 1");
}

void LandmarkCuller::watch(const std::vector<LandmarkId>& landmarks) {
  watched_.insert(watched_.end(), landmarks.begin(), landmarks.end());
}

int LandmarkCuller::cull(Map& map, KeyframeId newest) {
  int removed = 0;
  std::deque<LandmarkId> still_watched;
  for (const LandmarkId id : watched_) {
    const Landmark* landmark = map.find(id);
    if (landmark == nullptr) continue;
    const auto age = static_cast<int>(newest.value - landmark->created_by.value);
    const auto views = static_cast<int>(landmark->observations.size());
    const int needed = age < options_.probation ? 2 : options_.min_observations;
    if (landmark->times_found < options_.min_found_ratio * landmark->times_visible ||
        (age >= 2 && views < needed)) {
      map.remove_landmark(id);
      ++removed;
    } else if (age < options_.probation) {
      still_watched.push_back(id);
    }
  }
  watched_ = std::move(still_watched);
  return removed;
}

int cull_contradicted(Map& map, const std::vector<LandmarkId>& landmarks, const Camera& camera,
                      const SE3& T_camera_world, const Contradiction& frame, const MeasurementNoise& noise) {
  if (frame.depth.empty()) return 0;
  int removed = 0;
  for (const LandmarkId id : landmarks) {
    Landmark* landmark = map.find(id);
    if (landmark == nullptr) continue;
    const Eigen::Vector3d point = T_camera_world * landmark->position;
    if (point.z() <= 0.0) continue;
    if (!is_contradicted(point, camera.distort(camera.project(point)), frame, noise)) continue;
    ++landmark->contradicted;
    constexpr std::uint32_t kOften = 3;  // frames
    constexpr double kShare = 0.25;      // of the frames that found it
    if (landmark->contradicted >= kOften && landmark->contradicted > kShare * landmark->times_found) {
      map.remove_landmark(id);
      ++removed;
    }
  }
  return removed;
}

int cull_keyframes(Map& map, KeyframeId newest, const CullingOptions& options) {
  int removed = 0;
  const std::set<KeyframeId> origins = map.origins();
  for (const auto& [id, shared] : map.covisible(newest)) {
    const bool is_protected =
        origins.count(id) > 0 || id.value + static_cast<std::uint32_t>(options.keep_newest) > newest.value;
    const Keyframe* keyframe = map.find(id);
    if (is_protected || keyframe == nullptr || !is_redundant(map, *keyframe, options)) continue;
    const auto neighbours = map.covisible(id);
    map.remove_keyframe(id, neighbours.front().first);
    ++removed;
  }
  return removed;
}

}  // namespace roslam
