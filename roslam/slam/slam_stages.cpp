// SPDX-License-Identifier: BSD-3-Clause
// What happens to keyframes after tracking: mapping, loop closing, restoration and the dense map.
#include <exception>
#include <utility>

#include "roslam/slam/slam_impl.hpp"

namespace roslam {

namespace {
constexpr double kLabelsLast = 1.0;  // seconds that labels are carried to keyframes of the dense map
}  // namespace

// Removes a keyframe whose pose was withdrawn. False if it is there and to be mapped.
bool Slam::Impl::remove_withdrawn(KeyframeId keyframe) {
  {
    const MapLock lock(map_mutex, "removal of withdrawn keyframes");
    if (!map.is_withdrawn(keyframe)) return map.find(keyframe) == nullptr;
    map.remove_withdrawn(keyframe);
  }
  publish_poses(MapChangeKind::kWithdrawn);
  return true;
}

void Slam::Impl::map_keyframe(KeyframeId keyframe, const KeyframeWorker::ShouldStop& should_stop,
                              StageTimes& stage_times) {
  if (remove_withdrawn(keyframe)) return;
  mapper.process(keyframe, should_stop);
  publish_poses(MapChangeKind::kKeyframe);
  const LocalMapper::Times& t = mapper.times();
  stage_times.add("mapping.landmarks", t.landmarks);
  stage_times.add("mapping.fusion", t.fusion);
  stage_times.add("mapping.bundle_adjustment", t.bundle);
  stage_times.add("mapping.culling", t.culling);
  stage_times.add("mapping", t.landmarks + t.fusion + t.bundle + t.culling);
  if (loop_closer) closing.submit(keyframe);
}

// Tells restoration, the dense map and the program that keyframes have moved.
void Slam::Impl::publish_poses(MapChangeKind kind) {
  if (needs_poses()) {
    const MapLock lock(map_mutex, "publishing of poses");
    poses.publish(map);
  }
  if (dense && kind != MapChangeKind::kKeyframe) dense->follow_soon();
  if (!on_map_changed) return;
  // Changes are taken when they are told, so that none is lost with a call that is dropped, or overtaken.
  callbacks.post([this, kind] {
    MapLock lock(map_mutex, "publishing of poses");
    const MapChange change = live.change(kind);
    lock.unlock();
    if (!change.moved.empty() || !change.removed.empty()) on_map_changed(change);
  });
}

void Slam::Impl::close_loops(KeyframeId keyframe, const KeyframeWorker::ShouldStop& should_stop,
                             StageTimes& stage_times) {
  const std::size_t closed = loop_closer->closed().size();
  loop_closer->process(keyframe, should_stop, [this] { return closing.is_cancelled(); });
  const LoopCloser::Times& t = loop_closer->times();
  stage_times.add("loop.recognise", t.recognise);
  if (loop_closer->closed().size() == closed) return;
  publish_poses(MapChangeKind::kCorrection);
  stage_times.add("loop.correct", t.correct);
  stage_times.add("loop.fuse", t.fuse);
  stage_times.add("loop.bundle_adjustment", t.bundle);
}

// Hands a keyframe to mapping, restoration and the dense map.
void Slam::Impl::submit(KeyframeId keyframe, const Frame& frame, const DynamicObjects& objects) {
  mapping.submit(keyframe);
  if (!dense && !restoration) return;
  DenseInput input = dense_input(keyframe, frame, objects);
  if (stereo_depth) {  // also those without a right image, to keep the order
    stereo_depth->submit(keyframe, std::move(input));
  } else {
    hand_on(keyframe, std::move(input));
  }
}

DenseInput Slam::Impl::dense_input(KeyframeId keyframe, const Frame& frame, const DynamicObjects& objects) {
  DenseInput input;
  input.frame = frame;
  input.dynamic_objects = objects;
  if (!dense) return input;
  if (const auto noise = front_end.noise().depth()) input.depth_noise = options.noise.at_least(*noise);
  input.is_restored = restoration && options.dense.restore && options.dense.remove;
  if (front_end.labels().empty()) return input;
  const MapLock lock(map_mutex, kTracking, true);
  if (const auto T = log.T_frame_keyframe(map, front_end.labelled_index(), keyframe, kLabelsLast)) {
    input.labels = front_end.labels();
    input.has_older_labels = front_end.labelled_index() != frame.index;
    input.T_labelled_camera = *T;
  }
  return input;
}

// The dense map takes it first: restoration tells it of the restored keyframe.
void Slam::Impl::hand_on(KeyframeId keyframe, DenseInput input) {
  const Frame frame = input.frame;
  const DynamicObjects objects = input.dynamic_objects;
  if (dense) dense->submit(keyframe, std::move(input));
  if (restoration) restoration->submit(keyframe, frame, objects);
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
  if (stereo_depth) drain(*stereo_depth);
  if (restoration) drain(*restoration);
  if (dense) drain(*dense);
  callbacks.drain();
  if (failure) std::rethrow_exception(failure);
}

void Slam::Impl::cancel() {
  load.release();
  front_end.cancel();
  mapping.cancel();
  closing.cancel();
  if (stereo_depth) stereo_depth->cancel();
  if (restoration) restoration->cancel();
  if (dense) dense->cancel();
  callbacks.cancel();
}

}  // namespace roslam
