// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/slam_impl.hpp"

#include <chrono>
#include <exception>
#include <mutex>
#include <utility>

#include "roslam/common/stopwatch.hpp"
#include "roslam/mapping/culling.hpp"
#include "roslam/slam/settings.hpp"

namespace roslam {

namespace {
// Keyframes that may wait for global bundle adjustment; while it runs no loop is detected.
constexpr int kInterruptGlobalBundle = 20;
constexpr double kLabelsLast = 1.0;  // seconds that labels are carried to keyframes of the dense map

const Camera& validated(const Camera& camera) {
  camera.validate();
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
    : camera(validated(the_camera)),
      options(validated(the_options)),
      mode(the_mode),
      gate(camera),
      load(mode, camera.fps),
      front_end(camera, options, mode, std::move(segmenter), &load),
      map(front_end.level_scales()),
      tracker(camera, map, settings_of_tracker(options, vocabulary != nullptr)),
      keyframe_policy(options.keyframes),
      mapper(camera, map, map_mutex, mapper_settings(options)),
      closing([this](auto&&... work) { close_loops(work...); }, mode, kInterruptGlobalBundle,
              KeyframeWorker::OnFailure::kSwitchOff),
      mapping([this](auto&&... work) { map_keyframe(work...); }, mode, 1) {
  if (vocabulary == nullptr || !options.loop.enabled) return;
  keyframe_database.emplace(std::move(vocabulary));
  loop_closer.emplace(camera, map, *keyframe_database, map_mutex, loop_settings(options));
}

FrameResult Slam::Impl::process(const Frame& frame, const cv::Mat& mask) {
  mapping.check();
  FrameResult result;
  result.index = frame.index;
  result.timestamp = frame.timestamp;
  const auto verdict = gate.check(frame, mask);
  result.rejected = verdict.reason;
  if (!options.keyframes.enabled && map.keyframe_count() == 0)
    result.rejected = RejectReason::kNoMapToLocaliseIn;
  result.state = tracker.state();
  if (verdict.is_clock_reset) restart_clock(frame.timestamp);
  tracker.add_inertial(frame.inertial, frame.timestamp);
  if (!result.is_used()) {
    log.add_rejected(result.rejected);
    return result;
  }
  const Stopwatch watch;
  const auto begun = std::chrono::steady_clock::now();
  result.is_clock_reset = verdict.is_clock_reset;
  FrontEndResult observation = front_end.observe(frame, mask, predict_pose(frame.timestamp), log.frames());
  result.dynamic_objects = std::move(observation.dynamic_objects);
  result.warnings = std::move(observation.warnings);

  std::unique_lock map_lock(map_mutex);
  FrameHint hint{result.dynamic_objects.T_camera_world,
                 observation.hidden_share,
                 frame.depth,
                 observation.rested,
                 observation.may_start,
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

  result.tracking_seconds = watch.seconds();
  load.note_frame(std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
  note_times(observation, result.tracking_seconds);
  result.state = tracked.state;
  result.inliers = tracked.inliers;
  result.quality = tracked.quality;
  result.is_keyframe = keyframe.is_valid();
  if (tracked.T_camera_world) {
    result.T_world_camera = tracked.T_camera_world->inverse();
    if (tracked.state == TrackingState::kTracking) {
      for (const auto& d : unconstrained_directions(tracked.measurement_covariance, options.plausible))
        result.unconstrained.emplace_back(result.T_world_camera->rotation() * d);
    }
    result.covariance = covariance_in_world(*result.T_world_camera, tracked.covariance);
  }
  result.points = std::move(observation.points);
  result.removed_points = std::move(observation.removed_points);
  check_gyroscope(result);
  if (tracked.withdrawal) {
    for (const KeyframeId wrong : tracked.withdrawal->keyframes) mapping.submit(wrong);
  }
  if (keyframe.is_valid()) submit(keyframe, frame, result.dynamic_objects);
  return result;
}

// Called with the map's mutex held. Keyframes are not used from now on; they are removed by the thread that
// may be working on them.
void Slam::Impl::withdraw(const Withdrawal& wrong, FrameResult& result) {
  result.withdrawn = log.withdraw_after(wrong.after);
  result.withdrawn_after = wrong.after;
  for (const KeyframeId keyframe : wrong.keyframes) map.withdraw(keyframe);
  front_end.forget_poses();
}

// Removes a keyframe whose pose was withdrawn. False if it is there and to be mapped.
bool Slam::Impl::remove_withdrawn(KeyframeId keyframe) {
  const std::scoped_lock lock(map_mutex);
  if (!map.is_withdrawn(keyframe)) return map.find(keyframe) == nullptr;
  map.remove_withdrawn(keyframe);
  if (needs_poses()) poses.publish(map);
  return true;
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
  log.add_clock_reset();
}

std::optional<SE3> Slam::Impl::predict_pose(double timestamp) {
  if (!front_end.detects()) return std::nullopt;
  const std::scoped_lock lock(map_mutex);
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

void Slam::Impl::map_keyframe(KeyframeId keyframe, const KeyframeWorker::ShouldStop& should_stop,
                              StageTimes& stage_times) {
  if (remove_withdrawn(keyframe)) return;
  mapper.process(keyframe, should_stop);
  publish_poses();
  const LocalMapper::Times& t = mapper.times();
  stage_times.add("mapping.landmarks", t.landmarks);
  stage_times.add("mapping.fusion", t.fusion);
  stage_times.add("mapping.bundle_adjustment", t.bundle);
  stage_times.add("mapping.culling", t.culling);
  stage_times.add("mapping", t.landmarks + t.fusion + t.bundle + t.culling);
  if (loop_closer) closing.submit(keyframe);
}

void Slam::Impl::publish_poses() {
  if (!needs_poses()) return;
  const std::scoped_lock lock(map_mutex);
  poses.publish(map);
}

void Slam::Impl::close_loops(KeyframeId keyframe, const KeyframeWorker::ShouldStop& should_stop,
                             StageTimes& stage_times) {
  const std::size_t closed = loop_closer->closed().size();
  loop_closer->process(keyframe, should_stop, [this] { return closing.is_cancelled(); });
  const LoopCloser::Times& t = loop_closer->times();
  stage_times.add("loop.recognise", t.recognise);
  if (loop_closer->closed().size() == closed) return;
  publish_poses();
  stage_times.add("loop.correct", t.correct);
  stage_times.add("loop.fuse", t.fuse);
  stage_times.add("loop.bundle_adjustment", t.bundle);
}

// Hands a keyframe to mapping, restoration and the dense map.
void Slam::Impl::submit(KeyframeId keyframe, const Frame& frame, const DynamicObjects& objects) {
  mapping.submit(keyframe);
  if (dense) {
    DenseInput input;
    input.frame = frame;
    input.dynamic_objects = objects;
    if (const auto noise = front_end.noise().depth()) input.depth_noise = options.noise.at_least(*noise);
    input.is_restored = restoration && options.dense.restore && options.dense.remove;
    if (!front_end.labels().empty()) {
      const std::scoped_lock lock(map_mutex);
      if (const auto T = log.T_frame_keyframe(map, front_end.labelled_index(), keyframe, kLabelsLast)) {
        input.labels = front_end.labels();
        input.has_older_labels = front_end.labelled_index() != frame.index;
        input.T_labelled_camera = *T;
      }
    }
    dense->submit(keyframe, std::move(input));
  }
  if (restoration) restoration->submit(keyframe, frame, objects);
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

void Slam::Impl::finish() {
  load.release();
  // All, whatever the first throws: no thread may change the map when results are read.
  std::exception_ptr failure;
  const auto drain = [&](auto& worker) {
    try {
      worker.drain();
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  };
  drain(mapping);
  drain(closing);
  if (restoration) drain(*restoration);
  if (dense) drain(*dense);
  if (failure) std::rethrow_exception(failure);
}

void Slam::Impl::cancel() {
  load.release();
  front_end.cancel();
  mapping.cancel();
  closing.cancel();
  if (restoration) restoration->cancel();
  if (dense) dense->cancel();
}

}  // namespace roslam
