// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/slam.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "roslam/geometry/stopwatch.hpp"

namespace roslam {

namespace {
const Camera& validated(const Camera& camera) {
  camera.validate();
  return camera;
}

const Options& validated(const Options& options) {
  options.validate();
  return options;
}

std::vector<float> level_scales(const OrbExtractor& extractor) {
  std::vector<float> scales;
  for (int level = 0; level < extractor.levels(); ++level) scales.push_back(extractor.scale(level));
  return scales;
}
}  // namespace

Slam::Slam(const Camera& camera, const Options& options, Mode mode)
    : camera_(validated(camera)),
      options_(validated(options)),
      mode_(mode),
      extractor_(options.orb),
      map_(level_scales(extractor_)),
      tracker_(camera, map_, options.tracker_settings()),
      keyframe_policy_(options.keyframes),
      mapper_(camera, map_, map_mutex_, options.mapper_settings()),
      mapping_(mapper_, mode, options.threads.keyframe_queue) {}

std::optional<FrameResult> Slam::process(const Frame& frame, const cv::Mat& mask) {
  if (!is_usable(frame)) return std::nullopt;
  const Stopwatch watch;
  const auto view = extract(frame, mask);
  const double extract_seconds = watch.seconds();

  std::unique_lock map_lock(map_mutex_);
  TrackedFrame tracked = tracker_.track(view, frame.timestamp);
  KeyframeId keyframe;
  if (mapping_.has_room() && keyframe_policy_.promotes(tracked, map_, mapping_.is_idle())) {
    keyframe = mapper_.insert(tracked, frame.index);
    keyframe_policy_.promoted(tracked);
    tracker_.promoted(keyframe);
    tracked.reference = keyframe;
  }
  record(tracked);
  map_lock.unlock();

  const double seconds = watch.seconds();
  note_times(extract_seconds, seconds);
  if (keyframe.is_valid()) mapping_.submit(keyframe);

  FrameResult result{frame.index,     frame.timestamp,     tracked.state, std::nullopt,
                     tracked.inliers, keyframe.is_valid(), seconds};
  if (tracked.T_camera_world) result.T_world_camera = tracked.T_camera_world->inverse();
  return result;
}

bool Slam::is_usable(const Frame& frame) {
  const auto reject = [&](const std::string& reason) {
    ++rejected_[reason];
    return false;
  };
  const cv::Size size(camera_.width, camera_.height);
  if (frame.colour.empty()) return reject("no colour image");
  if (frame.colour.type() != CV_8UC3) return reject("colour image is not 8-bit BGR");
  if (frame.colour.size() != size) return reject("colour image size differs from the camera's");
  if (!frame.depth.empty() && frame.depth.type() != CV_32FC1)
    return reject("depth image is not 32-bit float");
  if (!frame.depth.empty() && frame.depth.size() != size) {
    return reject("depth image size differs from the colour image's");
  }
  if (!std::isfinite(frame.timestamp)) return reject("time is not a number");
  if (last_timestamp_ && frame.timestamp <= *last_timestamp_) return reject("time does not increase");
  last_timestamp_ = frame.timestamp;
  return true;
}

std::shared_ptr<const ObservedFrame> Slam::extract(const Frame& frame, const cv::Mat& mask) {
  cv::Mat grey;
  cv::cvtColor(frame.colour, grey, cv::COLOR_BGR2GRAY);
  const auto features = extractor_.extract(grey, mask);
  return std::make_shared<ObservedFrame>(
      observe(features, frame.colour, frame.depth, camera_, options_.depth));
}

void Slam::record(const TrackedFrame& frame) {
  ++frames_by_state_[frame.state];
  Record record{frame.timestamp, {}, {}};
  if (frame.T_camera_world && frame.reference.is_valid()) {
    record.reference = frame.reference;
    record.T_camera_reference = *frame.T_camera_world * map_.T_camera_world(frame.reference).inverse();
  }
  records_.push_back(record);
}

void Slam::note_times(double extract, double total) {
  const Tracker::Times& t = tracker_.times();
  times_.add("tracking.extract", extract);
  times_.add("tracking.match_frame", t.match_frame);
  times_.add("tracking.match_map", t.match_map);
  times_.add("tracking.optimise", t.optimise);
  times_.add("tracking.relocalise", t.relocalise);
  times_.add("tracking", total);
}

void Slam::finish() { mapping_.drain(); }

Trajectory Slam::trajectory() const {
  Trajectory result;
  for (const auto& record : records_) {
    if (!record.reference.is_valid()) continue;
    const SE3 T_camera_world = record.T_camera_reference * map_.T_camera_world(record.reference);
    result.push_back({record.timestamp, T_camera_world.inverse()});
  }
  return result;
}

Trajectory Slam::keyframes() const {
  Trajectory result;
  for (const KeyframeId id : map_.keyframe_ids()) {
    const Keyframe& keyframe = *map_.find(id);
    result.push_back({keyframe.timestamp, keyframe.T_camera_world.inverse()});
  }
  return result;
}

StageTimes Slam::times() const {
  StageTimes all = times_;
  all.add_all(mapping_.times());
  return all;
}

}  // namespace roslam
