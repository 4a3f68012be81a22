// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/mapping/new_landmarks.hpp"

#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "roslam/common/error.hpp"
#include "roslam/mapping/landmark_fit.hpp"

namespace roslam {

namespace {
// Points of a keyframe without a landmark, except on movable objects, which are not mapped.
std::vector<std::uint32_t> free_points(const Keyframe& keyframe) {
  std::vector<std::uint32_t> result;
  for (std::uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (!keyframe.landmarks[i].is_valid() && !keyframe.view->may_move(i)) result.push_back(i);
  }
  return result;
}

std::optional<Eigen::Vector3d> triangulate_points(const Keyframe& a, std::uint32_t in_a, const Keyframe& b,
                                                  std::uint32_t in_b, const Camera& camera,
                                                  double min_parallax) {
  const SE3 T_world_a = a.T_camera_world.inverse();
  const SE3 T_world_b = b.T_camera_world.inverse();
  const Eigen::Vector3d ray_a =
      T_world_a.rotation() * camera.unproject(a.view->pixels[in_a].cast<double>(), 1.0);
  const Eigen::Vector3d ray_b =
      T_world_b.rotation() * camera.unproject(b.view->pixels[in_b].cast<double>(), 1.0);
  const double cosine = ray_a.dot(ray_b) / (ray_a.norm() * ray_b.norm());
  if (cosine > std::cos(min_parallax * std::numbers::pi / 180.0)) return std::nullopt;
  return triangulate(T_world_a.translation(), ray_a, T_world_b.translation(), ray_b);
}
}  // namespace

void NewLandmarkOptions::validate() const {
  const auto require = [](bool condition, const char* message) {
    if (!condition) throw OptionsError(std::string("landmarks.") + message);
  };
  require(max_relative_depth_sigma > 0.0, "max_relative_depth_sigma must be positive");
  require(neighbours >= 0, "neighbours must not be negative");
  require(min_parallax > 0.0 && min_parallax < 90.0, "min_parallax must be 0 to 90 degrees");
  require(min_shared >= 1, "min_shared must be at least 1");
}

std::vector<LandmarkId> landmarks_from_depth(Map& map, KeyframeId id, const Camera& camera,
                                             const MeasurementNoise& noise,
                                             const NewLandmarkOptions& options) {
  const Keyframe& keyframe = *map.find(id);
  const SE3 T_world_camera = keyframe.T_camera_world.inverse();
  const ObservedFrame& view = *keyframe.view;
  std::vector<LandmarkId> created;
  for (const std::uint32_t i : free_points(keyframe)) {
    const double depth = view.depths[i];
    const bool is_sure =
        depth > 0.0 && view.relative_depth_sigma(i, noise.depth_noise()) <= options.max_relative_depth_sigma;
    if (!is_sure) continue;
    const Eigen::Vector3d position = T_world_camera * camera.unproject(view.pixels[i].cast<double>(), depth);
    created.push_back(map.add_landmark(position, id, i));
  }
  return created;
}

std::optional<Eigen::Vector3d> triangulate(const Eigen::Vector3d& origin_a,
                                           const Eigen::Vector3d& direction_a,
                                           const Eigen::Vector3d& origin_b,
                                           const Eigen::Vector3d& direction_b) {
  const Eigen::Vector3d a = direction_a.normalized();
  const Eigen::Vector3d b = direction_b.normalized();
  const Eigen::Vector3d between = origin_b - origin_a;
  const double cosine = a.dot(b);
  const double denominator = 1.0 - cosine * cosine;
  if (denominator < 1e-12) return std::nullopt;
  const double along_a = (between.dot(a) - cosine * between.dot(b)) / denominator;
  const double along_b = (cosine * between.dot(a) - between.dot(b)) / denominator;
  return 0.5 * (origin_a + along_a * a + origin_b + along_b * b);
}

std::vector<LandmarkId> landmarks_from_triangulation(Map& map, MapMutex& mutex, KeyframeId id,
                                                     const Camera& camera, const MeasurementNoise& noise,
                                                     const MatcherOptions& matcher,
                                                     const NewLandmarkOptions& options) {
  constexpr const char* kPurpose = "new landmarks";
  std::vector<KeyframeId> neighbours;
  {
    const MapLock lock(mutex, kPurpose);
    for (const auto& [neighbour, shared] : map.covisible(id, options.min_shared)) {
      if (static_cast<int>(neighbours.size()) < options.neighbours) neighbours.push_back(neighbour);
    }
  }
  std::vector<LandmarkId> created;
  for (const KeyframeId neighbour_id : neighbours) {
    std::vector<std::uint32_t> free;
    std::shared_ptr<const ObservedFrame> view, other;
    {
      const MapLock lock(mutex, kPurpose);
      const Keyframe* keyframe = map.find(id);
      const Keyframe* neighbour = map.find(neighbour_id);
      if (keyframe == nullptr || neighbour == nullptr) continue;
      free = free_points(*keyframe);
      view = keyframe->view;
      other = neighbour->view;
    }
    if (free.empty()) break;
    const auto matches = match_descriptors(*view, free, *other, matcher);
    const MapLock lock(mutex, kPurpose);
    if (map.find(id) == nullptr || map.find(neighbour_id) == nullptr) continue;
    const Keyframe& keyframe = *map.find(id);
    const Keyframe& neighbour = *map.find(neighbour_id);
    for (const auto& [ours, theirs] : matches) {
      const auto position =
          triangulate_points(keyframe, ours, neighbour, theirs, camera, options.min_parallax);
      const bool is_free = !keyframe.landmarks[ours].is_valid() && !neighbour.landmarks[theirs].is_valid();
      if (!position || !is_free || neighbour.view->may_move(theirs)) continue;
      if (!is_within_outlier_limit(map, keyframe, ours, *position, camera, noise) ||
          !is_within_outlier_limit(map, neighbour, theirs, *position, camera, noise)) {
        continue;
      }
      const LandmarkId landmark = map.add_landmark(*position, id, ours);
      map.add_observation(landmark, neighbour_id, theirs);
      map.refresh(landmark);
      created.push_back(landmark);
    }
  }
  return created;
}

}  // namespace roslam
