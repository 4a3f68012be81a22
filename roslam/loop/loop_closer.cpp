// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/loop/loop_closer.hpp"

#include <utility>

#include "roslam/error.hpp"
#include "roslam/geometry/stopwatch.hpp"

namespace roslam {

void LoopCloserOptions::validate() const {
  if (min_shared < 1) throw OptionsError("loop_closer.min_shared must be at least 1");
  if (!(max_error > 0.0)) throw OptionsError("loop_closer.max_error must be positive (sigmas)");
  if (bundle_iterations < 0 || bundle_iterations > 1000)
    throw OptionsError("loop_closer.bundle_iterations must be 0 to 1000");
}

LoopCloser::LoopCloser(const Camera& camera, Map& map, PlaceIndex& places, MapMutex& map_mutex,
                       const Settings& settings)
    : camera_(camera),
      map_(map),
      places_(places),
      map_mutex_(map_mutex),
      settings_(settings),
      detector_(settings.detector, PlaceCheck(camera, settings.place)) {
  settings.closer.validate();
  settings.pose_graph.validate();
}

void LoopCloser::process(KeyframeId keyframe, const std::function<bool()>& should_stop) {
  times_ = {};
  Stopwatch watch;
  const auto loop = recognise(keyframe);
  times_.recognise = watch.seconds();
  if (!loop) return;
  watch = {};
  const bool is_closed = join_worlds(*loop) || straighten(*loop);
  times_.correct = watch.seconds();
  if (!is_closed) return;
  watch = {};
  fuse(*loop);
  times_.fuse = watch.seconds();
  watch = {};
  adjust_all(should_stop);
  times_.bundle = watch.seconds();
}

std::optional<Loop> LoopCloser::recognise(KeyframeId keyframe) {
  std::shared_ptr<const ObservedFrame> view;
  {
    const std::scoped_lock lock(map_mutex_);
    const Keyframe* current = map_.find(keyframe);
    if (current == nullptr) return std::nullopt;
    view = current->view;
  }
  BagOfWords bag = places_.describe(*view);
  {
    const std::scoped_lock lock(map_mutex_);
    // So that the index grows with the map, not with time.
    places_.retain([this](KeyframeId id) { return map_.find(id) != nullptr; });
    places_.add(keyframe, std::move(bag));
  }
  return detector_.detect(map_, places_, map_mutex_, keyframe);
}

// False if keyframe and place are of one world.
bool LoopCloser::join_worlds(const Loop& loop) {
  const std::scoped_lock lock(map_mutex_);
  const Keyframe* keyframe = map_.find(loop.keyframe);
  const Keyframe* place = map_.find(loop.match.place);
  if (keyframe == nullptr || place == nullptr || keyframe->world == place->world) return false;
  const SE3 T_camera_old = keyframe->T_camera_world;
  // From the keyframe's world to that of the place.
  const SE3 T_place_keyframe = loop.match.T_camera_world.inverse() * T_camera_old;
  const bool is_newer = keyframe->world > place->world;
  const WorldId moving = is_newer ? keyframe->world : place->world;
  const WorldId resting = is_newer ? place->world : keyframe->world;
  MapCorrection correction;
  for (const KeyframeId id : map_.keyframe_ids()) {
    const bool moves = map_.find(id)->world == moving;
    correction.T_old_new[id] = !moves ? SE3() : (is_newer ? T_place_keyframe.inverse() : T_place_keyframe);
  }
  correction.apply_to(map_);
  map_.join_worlds(moving, resting);
  map_.add_loop(loop.match.place, loop.keyframe, loop.T_keyframe_place);
  detector_.reset();
  note(loop, T_camera_old, true);
  return true;
}

// Called with the mutex held. T_camera_old: of the keyframe before.
void LoopCloser::note(const Loop& loop, const SE3& T_camera_old, bool joins) {
  const SE3 T_camera_new = map_.find(loop.keyframe)->T_camera_world;
  const Eigen::Vector3d moved = T_camera_old.inverse().translation() - T_camera_new.inverse().translation();
  const double turned = (T_camera_old * T_camera_new.inverse()).angle();
  closed_.push_back({loop.keyframe, loop.match.place, moved.norm(), turned, loop.match.inliers, joins});
}

bool LoopCloser::straighten(const Loop& loop) {
  const LoopClosure closing{loop.match.place, loop.keyframe, loop.T_keyframe_place};
  auto taken = EssentialGraph::of(map_, map_mutex_, settings_.closer.min_shared, closing);
  if (!taken) return false;
  EssentialGraph& essential = *taken;
  const PoseGraph before = essential.graph;
  detector_.reset();
  if (!adjust_pose_graph(essential.graph, settings_.pose_graph).is_usable) return false;
  // A wrong loop asks for more than the map can give.
  if (edge_error(essential.graph, essential.graph.edges.back(), settings_.pose_graph).norm() >
      settings_.closer.max_error) {
    ++refused_;
    return false;
  }
  const MapCorrection correction = essential.correction(before);
  const std::scoped_lock lock(map_mutex_);
  if (map_.find(closing.from) == nullptr || map_.find(closing.to) == nullptr) return false;
  const SE3 T_camera_old = map_.find(closing.to)->T_camera_world;
  correction.apply_to(map_);
  map_.add_loop(closing.from, closing.to, closing.T_to_from);
  note(loop, T_camera_old, false);
  return true;
}

// What was mapped twice, before and after, becomes one.
void LoopCloser::fuse(const Loop& loop) {
  std::vector<KeyframeId> around{loop.keyframe};
  {
    const std::scoped_lock lock(map_mutex_);
    const Keyframe* keyframe = map_.find(loop.keyframe);
    if (keyframe == nullptr) return;
    for (const auto& [neighbour, shared] : map_.covisible(loop.keyframe, settings_.detector.min_shared))
      around.push_back(neighbour);
    for (std::uint32_t i = 0; i < loop.match.landmarks.size(); ++i) {
      const LandmarkId theirs = map_.resolve(loop.match.landmarks[i]);
      if (map_.find(theirs) == nullptr) continue;
      const LandmarkId ours = keyframe->landmarks[i];
      if (ours.is_valid()) {
        map_.merge_landmarks(ours, theirs);
      } else if (map_.add_observation(theirs, loop.keyframe, i)) {
        map_.refresh(theirs);
      }
    }
  }
  for (const KeyframeId id : around) {
    const std::scoped_lock lock(map_mutex_);
    if (map_.find(id) == nullptr) continue;
    fuse_landmarks(map_, id, camera_, settings_.place.noise, settings_.place.matcher, settings_.fusion);
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
  const std::scoped_lock lock(map_mutex_);
  correction.apply_to(map_);
}

}  // namespace roslam
