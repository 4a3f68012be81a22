// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop_closing/loop_closer.hpp"

#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/common/stopwatch.hpp"

namespace roslam {

void LoopCloserOptions::validate() const {
  if (min_shared < 1) throw OptionsError("loop_closer.min_shared must be at least 1");
  if (!(max_error > 0.0)) throw OptionsError("loop_closer.max_error must be positive (sigmas)");
  if (bundle_iterations < 0 || bundle_iterations > 1000)
    throw OptionsError("loop_closer.bundle_iterations must be 0 to 1000");
}

LoopCloser::LoopCloser(const Camera& camera, Map& map, KeyframeDatabase& database, MapMutex& map_mutex,
                       const Settings& settings)
    : camera_(camera),
      map_(map),
      keyframe_database_(database),
      map_mutex_(map_mutex),
      settings_(settings),
      detector_(settings.detector, GeometricVerifier(camera, settings.place)) {
  settings.closer.validate();
  settings.pose_graph.validate();
}

void LoopCloser::process(KeyframeId keyframe, const std::function<bool()>& should_stop,
                         const std::function<bool()>& is_cancelled) {
  times_ = {};
  Stopwatch watch;
  const auto loop = recognise(keyframe);
  times_.recognise = watch.seconds();
  if (!loop) return;
  watch = {};
  const bool is_closed = merge_submaps(*loop) || correct_loop(*loop, is_cancelled);
  times_.correct = watch.seconds();
  if (!is_closed) return;
  watch = {};
  fuse(*loop);
  times_.fuse = watch.seconds();
  watch = {};
  adjust_all(should_stop);
  times_.bundle = watch.seconds();
}

std::optional<DetectedLoop> LoopCloser::recognise(KeyframeId keyframe) {
  std::shared_ptr<const ObservedFrame> view;
  {
    const MapLock lock(map_mutex_, "place recognition");
    const Keyframe* current = map_.find(keyframe);
    if (current == nullptr) return std::nullopt;
    view = current->view;
  }
  BagOfWords bag = keyframe_database_.describe(*view);
  {
    const MapLock lock(map_mutex_, "place recognition");
    // Drops culled keyframes, so that the database grows with the map and not with time.
    keyframe_database_.retain([this](KeyframeId id) { return map_.find(id) != nullptr; });
    keyframe_database_.add(keyframe, std::move(bag));
  }
  return detector_.detect(map_, keyframe_database_, map_mutex_, keyframe);
}

// False if both keyframes are of one submap.
bool LoopCloser::merge_submaps(const DetectedLoop& loop) {
  const MapLock lock(map_mutex_, "merging of submaps");
  const Keyframe* keyframe = map_.find(loop.keyframe);
  const Keyframe* matched = map_.find(loop.match.matched_keyframe);
  if (keyframe == nullptr || matched == nullptr || keyframe->submap == matched->submap) return false;
  const SE3 T_camera_old = keyframe->T_camera_world;
  // From the coordinates of the newer keyframe's submap to those of the matched one's.
  const SE3 T_matched_current = loop.match.T_camera_world.inverse() * T_camera_old;
  const bool is_newer = keyframe->submap > matched->submap;
  const SubmapId moving = is_newer ? keyframe->submap : matched->submap;
  const SubmapId fixed = is_newer ? matched->submap : keyframe->submap;
  MapCorrection correction;
  for (const KeyframeId id : map_.keyframe_ids()) {
    const bool moves = map_.find(id)->submap == moving;
    correction.T_old_new[id] = !moves ? SE3() : (is_newer ? T_matched_current.inverse() : T_matched_current);
  }
  correction.apply_to(map_);
  map_.merge_submaps(moving, fixed);
  map_.add_loop(loop.match.matched_keyframe, loop.keyframe, loop.T_keyframe_matched);
  detector_.reset();
  note(loop, T_camera_old, true);
  return true;
}

// Called with the mutex held. T_camera_old: T_camera_world of the newer keyframe before the correction.
void LoopCloser::note(const DetectedLoop& loop, const SE3& T_camera_old, bool merges_submaps) {
  const SE3 T_camera_new = map_.find(loop.keyframe)->T_camera_world;
  const Eigen::Vector3d moved = T_camera_old.inverse().translation() - T_camera_new.inverse().translation();
  const double turned = (T_camera_old * T_camera_new.inverse()).angle();
  closed_.push_back(
      {loop.keyframe, loop.match.matched_keyframe, moved.norm(), turned, loop.match.inliers, merges_submaps});
}

bool LoopCloser::correct_loop(const DetectedLoop& loop, const std::function<bool()>& is_cancelled) {
  const LoopClosure closing{loop.match.matched_keyframe, loop.keyframe, loop.T_keyframe_matched};
  auto snapshot = EssentialGraph::of(map_, map_mutex_, settings_.closer.min_shared, closing);
  if (!snapshot) return false;
  EssentialGraph& essential = *snapshot;
  const PoseGraph before = essential.graph;
  detector_.reset();
  if (!adjust_pose_graph(essential.graph, settings_.pose_graph, is_cancelled).is_usable) return false;
  if (is_cancelled && is_cancelled()) return false;  // half a correction is none
  // A wrong loop contradicts the other edges, so its error stays large.
  if (edge_error(essential.graph, essential.graph.edges.back(), settings_.pose_graph).norm() >
      settings_.closer.max_error) {
    const MapLock lock(map_mutex_, "loop correction");
    ++refused_;
    return false;
  }
  const MapCorrection correction = essential.correction(before);
  const MapLock lock(map_mutex_, "loop correction");
  if (map_.find(closing.from) == nullptr || map_.find(closing.to) == nullptr) return false;
  const SE3 T_camera_old = map_.find(closing.to)->T_camera_world;
  correction.apply_to(map_);
  map_.add_loop(closing.from, closing.to, closing.T_to_from);
  note(loop, T_camera_old, false);
  return true;
}

// Merges landmarks that were mapped twice, before and after the loop.
void LoopCloser::fuse(const DetectedLoop& loop) {
  std::vector<KeyframeId> neighbourhood{loop.keyframe};
  {
    const MapLock lock(map_mutex_, "fusion after a loop");
    const Keyframe* keyframe = map_.find(loop.keyframe);
    if (keyframe == nullptr) return;
    for (const auto& [neighbour, shared] : map_.covisible(loop.keyframe, settings_.detector.min_shared))
      neighbourhood.push_back(neighbour);
    for (std::uint32_t i = 0; i < loop.match.landmarks.size(); ++i) {
      const LandmarkId theirs = map_.resolve(loop.match.landmarks[i]);
      if (map_.find(theirs) == nullptr || keyframe->view->may_move(i)) continue;
      const LandmarkId ours = keyframe->landmarks[i];
      if (ours.is_valid()) {
        map_.merge_landmarks(ours, theirs);
      } else if (map_.add_observation(theirs, loop.keyframe, i)) {
        map_.refresh(theirs);
      }
    }
  }
  for (const KeyframeId id : neighbourhood) {
    fuse_landmarks(map_, map_mutex_, id, camera_, settings_.place.noise, settings_.place.matcher,
                   settings_.fusion);
  }
}

void LoopCloser::adjust_all(const std::function<bool()>& should_stop) {
  if (settings_.closer.bundle_iterations == 0) return;
  GlobalBundle bundle = GlobalBundle::of(map_, map_mutex_, settings_.place.noise);
  const BundleProblem before = bundle.problem;
  BundleAdjustmentOptions options = settings_.bundle;
  options.iterations = settings_.closer.bundle_iterations;
  if (!adjust_bundle(camera_, bundle.problem, options, should_stop).is_usable) return;
  const MapCorrection correction = bundle.correction(before);
  const MapLock lock(map_mutex_, "result of global bundle adjustment");
  correction.apply_to(map_);
}

}  // namespace roslam
