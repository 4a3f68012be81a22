// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/slam_impl.hpp"

#include <chrono>
#include <utility>

#include "roslam/common/stopwatch.hpp"
#include "roslam/mapping/culling.hpp"
#include "roslam/options/settings.hpp"

namespace roslam {

namespace {
// Keyframes that may wait for global bundle adjustment; while it runs no loop is detected.
constexpr int kInterruptGlobalBundle = 20;

const Camera& validated(const Camera& camera) {
  camera.validate();
  return camera;
}

// Of a stereo camera whose depth noise is not known: as its baseline lets expect.
Camera with_depth_noise(Camera camera, const StereoOptions& options) {
  if (camera.is_stereo() && !camera.depth_noise) camera.depth_noise = dense_stereo_noise(camera, options);
  return camera;
}

const Options& validated(const Options& options) {
  options.validate();
  return options;
}

// A submap needs keyframes, and a loop closer that can merge it.
Tracker::Settings settings_of_tracker(const Options& options, bool has_vocabulary) {
  Tracker::Settings settings = tracker_settings(options);
  if (!options.keyframes.enabled || !options.loop.enabled || !has_vocabulary)
    settings.tracker.new_submap_after_lost = 0;
  return settings;
}
}  // namespace

Slam::Impl::Impl(const Camera& the_camera, const Options& the_options, Mode the_mode,
                 std::shared_ptr<Segmenter> segmenter, std::shared_ptr<const Vocabulary> vocabulary)
    : camera(with_depth_noise(validated(the_camera), the_options.stereo)),
      options(validated(the_options)),
      mode(the_mode),
      gate(camera),
      load(mode, camera.fps),
      front_end(camera, options, mode, std::move(segmenter), &load),
      map(front_end.level_scales()),
      tracker(camera, map, settings_of_tracker(options, vocabulary != nullptr)),
      odometry(camera.T_body_camera),
      level(camera),
      keyframe_policy(options.keyframes),
      mapper(camera, map, map_mutex, mapper_settings(options)),
      live(map, map_mutex, log),
      callbacks(mode),
      closing([this](auto&&... work) { close_loops(work...); }, mode, kInterruptGlobalBundle,
              KeyframeWorker::OnFailure::kSwitchOff),
      mapping([this](auto&&... work) { map_keyframe(work...); }, mode, 1) {
  if (camera.is_stereo()) {
    dense_stereo.emplace(camera, options.stereo);
    stereo_depth.emplace(
        *dense_stereo, mode, options.dense.queue,
        [this](KeyframeId keyframe, DenseInput input) { hand_on(keyframe, std::move(input)); });
  }
  if (vocabulary == nullptr || !options.loop.enabled) return;
  keyframe_database.emplace(std::move(vocabulary));
  loop_closer.emplace(camera, map, *keyframe_database, map_mutex, loop_settings(options));
}

FrameResult Slam::Impl::process(const Frame& frame, const cv::Mat& mask) {
  FrameResult result = track(frame, mask);
  result.latency = std::chrono::duration<double>(std::chrono::steady_clock::now() - result.received).count();
  if (result.is_used()) latency.add("latency", result.latency);
  if (on_frame) callbacks.post([this, result] { on_frame(result); });
  return result;
}

// Where dynamic objects are detected by depth, each frame of a stereo pair needs it.
Frame Slam::Impl::with_depth(const Frame& frame) {
  if (!dense_stereo || !options.stereo.every_frame || !front_end.needs_depth()) return frame;
  const Stopwatch watch;
  Frame result = dense_stereo->with_depth(frame);
  times.add("tracking.dense_stereo", watch.seconds());
  return result;
}

FrameResult Slam::Impl::track(const Frame& given, const cv::Mat& mask) {
  mapping.check();
  FrameResult result;
  result.received = given.received.value_or(std::chrono::steady_clock::now());
  result.index = given.index;
  result.timestamp = given.timestamp;
  const auto verdict = gate.check(given, mask);
  result.rejected = verdict.reason;
  if (!options.keyframes.enabled && map.keyframe_count() == 0)
    result.rejected = RejectReason::kNoMapToLocaliseIn;
  result.state = tracker.state();
  if (verdict.is_clock_reset) restart_clock(given.timestamp);
  tracker.add_inertial(given.inertial, given.timestamp);
  level.add_inertial(given.inertial);
  if (!result.is_used()) {
    log.add_rejected(result.rejected);
    return result;
  }
  const Stopwatch watch;
  const auto begun = std::chrono::steady_clock::now();
  result.is_clock_reset = verdict.is_clock_reset;
  const Frame frame = with_depth(given);
  FrontEndResult observation = front_end.observe(frame, mask, predict_pose(frame.timestamp), log.frames());
  result.dynamic_objects = std::move(observation.dynamic_objects);
  result.warnings = std::move(observation.warnings);

  MapLock map_lock(map_mutex, kTracking, true);
  const bool is_levelled = level_world();
  FrameHint hint{result.dynamic_objects.T_camera_world,
                 observation.hidden_share,
                 frame.depth,
                 observation.rested,
                 observation.may_start,
                 level.T_camera_start(map.keyframe_count() == 0),
                 [&] { return similar_keyframes(*observation.view); }};
  // A pose in the map as it was before a correction is no hint any more.
  if (front_end.follow_corrections(map, tracker.last_pose())) hint.T_camera_world.reset();
  TrackedFrame tracked = tracker.track(observation.view, frame.timestamp, hint);
  tracked.hidden = count_hidden_landmarks(map, tracked, camera, result.dynamic_objects.mask);
  const KeyframeId keyframe = create_keyframe(tracked, frame.index);
  log.add(tracked, frame.index, map);
  if (tracked.withdrawal) withdraw(*tracked.withdrawal, result);
  log.add_evidence(landmarks_on_objects(map, tracked, camera, result.dynamic_objects.mask, frame.depth));
  front_end.remember(tracked, map, observation, keyframe.is_valid());
  if (tracked.reference.is_valid()) result.submap = map.submap_of(tracked.reference);
  cull_contradicted(tracked, frame, result.dynamic_objects);
  map_lock.unlock();
  if (is_levelled) publish_poses(MapChangeKind::kLevelled);
  result.odometry = odometry.add(tracked, result.submap);
  level.track(result.odometry);

  result.tracking_seconds = watch.seconds();
  load.note_frame(std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
  note_times(observation, result.tracking_seconds);
  fill(result, tracked);
  result.is_keyframe = keyframe.is_valid();
  result.points = std::move(observation.points);
  result.removed_points = std::move(observation.removed_points);
  check_gyroscope(result);
  if (tracked.withdrawal) {
    for (const KeyframeId wrong : tracked.withdrawal->keyframes) mapping.submit(wrong);
  }
  if (keyframe.is_valid()) submit(keyframe, frame, result.dynamic_objects);
  return result;
}

// What tracking found.
void Slam::Impl::fill(FrameResult& result, const TrackedFrame& tracked) const {
  result.state = tracked.state;
  result.inliers = tracked.inliers;
  result.quality = tracked.quality;
  result.no_pose = reason_of(tracked);
  if (tracked.T_camera_world) {
    result.T_world_camera = tracked.T_camera_world->inverse();
    if (tracked.state == TrackingState::kTracking) {
      for (const auto& d : unconstrained_directions(tracked.measurement_covariance, options.plausible))
        result.unconstrained.emplace_back(result.T_world_camera->rotation() * d);
    }
    result.covariance = covariance_in_world(*result.T_world_camera, tracked.covariance);
  }
}

// Turns the world once gravity is known better, unless its frame was given. Called with the map's mutex held.
bool Slam::Impl::level_world() {
  if (map.corrections() != corrections_seen) level.restart();
  corrections_seen = map.corrections();
  // A loop that is being closed is corrected in the world as it was.
  if (map.session() > 0 || !closing.is_idle() || map.submaps().size() != 1) return false;
  const auto R_level_world = level.correction();
  if (!R_level_world) return false;
  const SE3 T_level_world(*R_level_world, Eigen::Vector3d::Zero());
  map.transform(map.submaps().front(), T_level_world);
  map.note_correction();
  odometry.world_changed(T_level_world);
  return true;
}

// Called with the map's mutex held. Keyframes are not used from now on; they are removed by the thread that
// may be working on them.
void Slam::Impl::withdraw(const Withdrawal& wrong, FrameResult& result) {
  result.withdrawn = log.withdraw_after(wrong.after);
  result.withdrawn_after = wrong.after;
  for (const KeyframeId keyframe : wrong.keyframes) map.withdraw(keyframe);
  front_end.forget_poses();
}

void Slam::Impl::check_gyroscope(FrameResult& result) {
  const auto& gyroscope = tracker.gyroscope();
  if (warned_of_gyroscope || !gyroscope || gyroscope->agrees_with_images()) return;
  warned_of_gyroscope = true;
  result.warnings.emplace_back(kGyroscopeContradicts);
}

void Slam::Impl::restart_clock(double timestamp) {
  tracker.restart_clock(timestamp);
  keyframe_policy.restart_clock(timestamp);
  front_end.reset();
  odometry.restart_clock(timestamp);
  level.restart_clock();
  log.add_clock_reset();
}

std::optional<SE3> Slam::Impl::predict_pose(double timestamp) {
  if (!front_end.detects()) return std::nullopt;
  const MapLock lock(map_mutex, kTracking, true);
  front_end.follow_corrections(map, tracker.last_pose());
  return tracker.predicted_pose(timestamp);
}

// Called with the map's mutex held. Returns an invalid id if the frame does not become a keyframe.
KeyframeId Slam::Impl::create_keyframe(TrackedFrame& tracked, std::size_t frame_index) {
  const bool begins_submap = tracked.T_camera_world && !tracked.reference.is_valid();
  const bool has_room = mapping.waiting() < static_cast<std::size_t>(options.threads.keyframe_queue);
  if (!(has_room || begins_submap) || !keyframe_policy.needs_keyframe(tracked, map, mapping.is_idle()))
    return {};
  const KeyframeId keyframe = mapper.insert(tracked, frame_index);
  if (needs_poses()) poses.add(map, keyframe);
  keyframe_policy.keyframe_created(tracked);
  tracker.keyframe_created(keyframe);
  tracked.reference = keyframe;
  return keyframe;
}

// Called with the map's mutex held.
std::vector<KeyframeId> Slam::Impl::similar_keyframes(const ObservedFrame& view) const {
  std::vector<KeyframeId> result;
  if (!keyframe_database) return result;
  const auto exists = [this](KeyframeId id) { return map.find(id) != nullptr && !map.is_withdrawn(id); };
  for (const auto& found : keyframe_database->similar(keyframe_database->describe(view), exists))
    result.push_back(found.keyframe);
  return result;
}

// Removes landmarks that were mapped before their object was known to move.
void Slam::Impl::cull_contradicted(const TrackedFrame& tracked, const Frame& frame,
                                   const DynamicObjects& objects) {
  if (!front_end.detects() || !options.keyframes.enabled || tracked.state != TrackingState::kTracking) return;
  cv::Mat moving;
  for (const auto& object : objects.objects) {
    if (moving.empty()) moving = cv::Mat::zeros(frame.colour.size(), CV_8UC1);
    draw_object(object, moving);
  }
  roslam::cull_contradicted(map, tracker.local_landmarks(), camera, *tracked.T_camera_world,
                            {moving, frame.depth}, options.noise);
}

void Slam::Impl::note_times(const FrontEndResult& observation, double total) {
  const Tracker::Times& t = tracker.times();
  if (front_end.detects()) times.add("tracking.removal", observation.detection_seconds);
  times.add("tracking.extract", observation.extraction_seconds);
  times.add("tracking.match_frame", t.match_frame);
  times.add("tracking.match_map", t.match_map);
  times.add("tracking.optimise", t.optimise);
  times.add("tracking.relocalise", t.relocalise);
  times.add("tracking", total);
}

}  // namespace roslam
