// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/mapping/local_mapper.hpp"

#include "roslam/common/stopwatch.hpp"

namespace roslam {

LocalMapper::LocalMapper(const Camera& camera, Map& map, MapMutex& map_mutex, const Settings& settings)
    : camera_(camera),
      map_(map),
      map_mutex_(map_mutex),
      settings_(settings),
      landmark_culler_(settings.culling) {
  settings.landmarks.validate();
  settings.fusion.validate();
  settings.culling.validate();
  settings.bundle.validate();
}

KeyframeId LocalMapper::insert(const TrackedFrame& frame, std::size_t frame_index) {
  const KeyframeId id =
      map_.add_keyframe(frame_index, frame.timestamp, *frame.T_camera_world, frame.view, submap_of(frame));
  for (std::uint32_t i = 0; i < frame.landmarks.size(); ++i) {
    if (!frame.landmarks[i].is_valid() || frame.view->may_move(i)) continue;
    if (map_.add_observation(frame.landmarks[i], id, i)) map_.refresh(frame.landmarks[i]);
  }
  landmark_culler_.watch(landmarks_from_depth(map_, id, camera_, settings_.noise, settings_.landmarks));
  return id;
}

// A frame without a reference keyframe is the first of a new submap.
SubmapId LocalMapper::submap_of(const TrackedFrame& frame) {
  if (map_.keyframe_count() == 0) return SubmapId{0};
  if (!frame.reference.is_valid()) return map_.new_submap();
  return map_.submap_of(frame.reference);
}

void LocalMapper::process(KeyframeId keyframe, const std::function<bool()>& should_stop) {
  times_ = {};
  {
    const Stopwatch watch;
    const MapLock lock(map_mutex_, "culling of landmarks");
    landmark_culler_.cull(map_, keyframe);
    times_.culling += watch.seconds();
  }
  {
    const Stopwatch watch;
    const auto created = landmarks_from_triangulation(map_, map_mutex_, keyframe, camera_, settings_.noise,
                                                      settings_.matcher, settings_.landmarks);
    const MapLock lock(map_mutex_, "new landmarks");  // which guards the culler as well
    landmark_culler_.watch(created);
    times_.landmarks += watch.seconds();
  }
  {
    const Stopwatch watch;
    fuse_landmarks(map_, map_mutex_, keyframe, camera_, settings_.noise, settings_.matcher, settings_.fusion);
    times_.fusion += watch.seconds();
  }
  const Stopwatch watch;
  adjust_around(keyframe, should_stop);
  times_.bundle += watch.seconds();
  const Stopwatch culling_watch;
  const MapLock lock(map_mutex_, "culling of keyframes");
  cull_keyframes(map_, keyframe, settings_.culling);
  times_.culling += culling_watch.seconds();
}

void LocalMapper::adjust_around(KeyframeId keyframe, const std::function<bool()>& should_stop) {
  LocalBundle local;
  std::size_t corrections = 0;
  {
    const MapLock lock(map_mutex_, "reading for bundle adjustment");
    corrections = map_.corrections();
    if (map_.keyframe_count() < 2) return;
    local = LocalBundle::around(map_, keyframe, settings_.noise, settings_.bundle);
  }
  const BundleSummary summary = adjust_bundle(camera_, local.problem, settings_.bundle, should_stop);
  if (!summary.is_usable) return;
  const MapLock lock(map_mutex_, "result of bundle adjustment");
  if (map_.corrections() != corrections) return;  // a loop closure moved the map meanwhile
  local.apply_to(map_, camera_);
}

LocalBundle LocalBundle::around(const Map& map, KeyframeId keyframe, const MeasurementNoise& noise,
                                const BundleAdjustmentOptions& options) {
  LocalBundle local;
  std::vector<int> pose_of(map.keyframe_slots(), -1);
  const std::set<KeyframeId> origins = map.origins();
  const auto add_pose = [&](KeyframeId id, bool is_fixed) {
    pose_of[id.index()] = static_cast<int>(local.keyframes.size());
    local.keyframes.push_back(id);
    local.problem.poses.push_back({map.find(id)->T_camera_world, is_fixed});
  };
  add_pose(keyframe, origins.count(keyframe) > 0);
  for (const auto& [id, shared] : map.covisible(keyframe, options.min_shared)) {
    if (static_cast<int>(local.keyframes.size()) >= options.window) break;
    add_pose(id, origins.count(id) > 0);
  }
  std::vector<bool> is_in(map.landmark_slots(), false);
  const std::vector<KeyframeId> window = local.keyframes;
  for (const KeyframeId id : window) {
    for (const LandmarkId landmark : map.find(id)->landmarks) {
      if (!landmark.is_valid() || is_in[landmark.index()]) continue;
      // A landmark seen once does not constrain the pose.
      if (map.find(landmark)->observations.size() < 2) continue;
      is_in[landmark.index()] = true;
      local.landmarks.push_back(landmark);
    }
  }
  for (std::size_t p = 0; p < local.landmarks.size(); ++p) {
    const Landmark& landmark = *map.find(local.landmarks[p]);
    local.problem.points.push_back(landmark.position);
    for (const auto& observation : landmark.observations) {
      if (pose_of[observation.keyframe.index()] < 0) add_pose(observation.keyframe, true);
      const ObservedFrame& view = *map.find(observation.keyframe)->view;
      const std::uint32_t i = observation.point;
      local.problem.terms.push_back({static_cast<std::size_t>(pose_of[observation.keyframe.index()]), p,
                                     map.measurement(view, i, noise)});
    }
  }
  return local;
}

void LocalBundle::apply_to(Map& map, const Camera& camera) const {
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    Keyframe* keyframe = map.find(keyframes[i]);
    if (keyframe != nullptr && !problem.poses[i].is_fixed)
      keyframe->T_camera_world = problem.poses[i].T_camera_world;
  }
  for (std::size_t p = 0; p < landmarks.size(); ++p) {
    if (Landmark* landmark = map.find(landmarks[p])) landmark->position = problem.points[p];
  }
  const auto is_inlier = bundle_inliers(camera, problem);
  for (std::size_t t = 0; t < problem.terms.size(); ++t) {
    if (is_inlier[t]) continue;
    map.remove_observation(landmarks[problem.terms[t].point], keyframes[problem.terms[t].pose]);
  }
  for (const LandmarkId id : landmarks) map.refresh_geometry(id);
}

}  // namespace roslam
