// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/tracking/initial_pose.hpp"

#include <algorithm>

#include "roslam/common/upper_median.hpp"

namespace roslam {

namespace {
constexpr LandmarkId kTemporary{LandmarkId::kNone - 1};  // marks points of the frame with a temporary point
constexpr LandmarkId kTaken{LandmarkId::kNone - 2};      // that are not to be matched
}  // namespace

// Drops the matches whose feature turned otherwise than most.
void InitialPoseEstimator::Matches::keep_consistent_rotation(std::vector<LandmarkId>& landmarks) {
  const auto keep = consistent_rotation(rotations);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < points.size(); ++k) {
    if (keep[k]) {
      positions[kept] = positions[k];
      points[kept++] = points[k];
    } else {
      landmarks[points[k]] = {};
    }
  }
  positions.resize(kept);
  points.resize(kept);
}

// In the world: that of its landmark, or by its depth.
std::optional<Eigen::Vector3d> InitialPoseEstimator::position_of(const TrackedFrame& last, std::size_t point,
                                                                 const SE3& T_world_last) const {
  if (const Landmark* landmark = map_.find(map_.resolve(last.landmarks[point]))) return landmark->position;
  constexpr float kSure = 0.1F;  // of the depth: the point is taken for exact
  if (!last.view->has_depth(point, kSure)) return std::nullopt;
  return T_world_last * camera_.unproject(last.view->pixels[point].cast<double>(), last.view->depths[point]);
}

std::optional<PoseCandidate> InitialPoseEstimator::from_last_frame(const ObservedFrame& view,
                                                                   const TrackedFrame& last,
                                                                   const SE3& T_world_last,
                                                                   const SE3& predicted_T_camera_world,
                                                                   const Search& search) {
  PoseCandidate candidate;
  candidate.T_camera_world = predicted_T_camera_world;
  candidate.landmarks.resize(view.size());
  const RestingPoints resting{{}, 0.0, search.rested};
  for (std::size_t i = 0; i < view.size(); ++i) {
    if (view.may_move(i) && !resting.has_rested(i)) candidate.landmarks[i] = kTaken;
  }
  Matches matches;
  for (std::size_t i = 0; i < last.view->size(); ++i) {
    const auto position = position_of(last, i, T_world_last);
    if (!position) continue;
    const Eigen::Vector3d in_camera = predicted_T_camera_world * *position;
    if (in_camera.z() <= 0.0) continue;
    const Eigen::Vector2f pixel = camera_.project(in_camera).cast<float>();
    if (!view.grid.contains(pixel)) continue;
    const int level = last.view->levels[i];
    const float radius =
        search.radius_factor * static_cast<float>(settings_.matcher.frame_radius) * map_.scale(level);
    const int match = matcher_.find({pixel, radius, level - 1, level + 1, static_cast<float>(in_camera.z()),
                                     settings_.matcher.max_distance, false},
                                    last.view->descriptors[i], view, candidate.landmarks);
    if (match < 0) continue;
    const LandmarkId id = map_.resolve(last.landmarks[i]);
    const auto point = static_cast<std::uint32_t>(match);
    candidate.landmarks[point] = map_.find(id) != nullptr ? id : kTemporary;
    matches.positions.push_back(*position);
    matches.points.push_back(point);
    matches.rotations.push_back(last.view->angles[i] - view.angles[point]);
  }
  for (LandmarkId& landmark : candidate.landmarks) {
    if (landmark == kTaken) landmark = {};
  }
  matches.keep_consistent_rotation(candidate.landmarks);
  return estimate(view, matches, std::move(candidate));
}

std::optional<PoseCandidate> InitialPoseEstimator::from_keyframe(const ObservedFrame& view,
                                                                 const Keyframe& keyframe,
                                                                 const SE3& initial_T_camera_world) const {
  std::vector<std::uint32_t> known;
  for (std::uint32_t i = 0; i < keyframe.landmarks.size(); ++i) {
    if (keyframe.landmarks[i].is_valid()) known.push_back(i);
  }
  PoseCandidate candidate;
  candidate.T_camera_world = initial_T_camera_world;
  candidate.landmarks.resize(view.size());
  Matches matches;
  for (const auto& [theirs, ours] : match_descriptors(*keyframe.view, known, view, settings_.matcher)) {
    candidate.landmarks[ours] = keyframe.landmarks[theirs];
    matches.positions.push_back(map_.find(keyframe.landmarks[theirs])->position);
    matches.points.push_back(ours);
  }
  return estimate(view, matches, std::move(candidate));
}

std::optional<PoseCandidate> InitialPoseEstimator::estimate(const ObservedFrame& view, const Matches& matches,
                                                            PoseCandidate candidate) const {
  const TrackerOptions& options = settings_.tracker;
  if (static_cast<int>(matches.points.size()) < options.min_frame_matches) return std::nullopt;
  const OptimisedPose pose =
      optimise_frame(camera_, map_, view, matches.points, matches.positions, candidate.T_camera_world,
                     settings_.noise, settings_.pose, candidate.landmarks);
  const double needed = std::max<double>(options.min_frame_matches,
                                         options.min_agreement * static_cast<double>(matches.points.size()));
  if (pose.inliers < needed) return std::nullopt;
  candidate.T_camera_world = pose.T_camera_world;
  candidate.inliers = pose.inliers;
  for (std::size_t k = 0; k < matches.points.size(); ++k) {
    LandmarkId& landmark = candidate.landmarks[matches.points[k]];
    if (landmark != kTemporary) continue;
    candidate.temporary.push_back({matches.points[k], matches.positions[k]});
    landmark = {};
  }
  return candidate;
}

double InitialPoseEstimator::disagreement(const TrackedFrame& last, const SE3& T_world_last,
                                          const SE3& a_T_camera_world, const SE3& b_T_camera_world) const {
  constexpr std::size_t kEvery = 10;  // points: a sample suffices for the median
  std::vector<double> distances;
  for (std::size_t i = 0; i < last.view->size(); i += kEvery) {
    const auto position = position_of(last, i, T_world_last);
    if (!position) continue;
    const Eigen::Vector3d a = a_T_camera_world * *position;
    const Eigen::Vector3d b = b_T_camera_world * *position;
    if (a.z() > 0.0 && b.z() > 0.0) distances.push_back((camera_.project(a) - camera_.project(b)).norm());
  }
  return distances.empty() ? 0.0 : upper_median(distances);
}

OptimisedPose optimise_frame(const Camera& camera, const Map& map, const ObservedFrame& view,
                             const std::vector<std::uint32_t>& points,
                             const std::vector<Eigen::Vector3d>& positions, const SE3& initial_T_camera_world,
                             const MeasurementNoise& noise, const PoseOptimiserOptions& options,
                             std::vector<LandmarkId>& landmarks, const RestingPoints& resting) {
  std::vector<PoseMeasurement> measurements(points.size());
  for (std::size_t k = 0; k < points.size(); ++k) {
    measurements[k].point_world = positions[k];
    measurements[k].measurement = map.measurement(view, points[k], noise);
    if (view.may_move(points[k]) && !resting.has_rested(points[k])) measurements[k].weight = resting.weight;
  }
  for (const auto& [point, position] : resting.points)
    measurements.push_back({position, map.measurement(view, point, noise), resting.weight});
  OptimisedPose pose = optimise_pose(camera, measurements, initial_T_camera_world, options);
  for (std::size_t k = 0; k < measurements.size(); ++k) {
    const bool is_static = k < points.size() && (!view.may_move(points[k]) || resting.has_rested(points[k]));
    if (!is_static && pose.is_inlier[k]) --pose.inliers;
    if (k < points.size() && !pose.is_inlier[k]) landmarks[points[k]] = {};
  }
  return pose;
}

}  // namespace roslam
