// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/slam.hpp"

#include <cmath>
#include <exception>
#include <opencv2/imgproc.hpp>

#include "roslam/error.hpp"
#include "roslam/geometry/stopwatch.hpp"

namespace roslam {

namespace {
// Keyframes that may wait for global bundle adjustment; while it runs no place is recognised.
constexpr int kLoopPatience = 20;

const Camera& validated(const Camera& camera) {
  camera.validate();
  return camera;
}

const Options& validated(const Options& options) {
  options.validate();
  return options;
}

// A world without keyframes is none, and one that no loop closer could ever join is not begun.
Tracker::Settings tracker_settings(const Options& options, bool has_vocabulary) {
  Tracker::Settings settings = options.tracker_settings();
  if (!options.keyframes.enabled || !options.loop.enabled || !has_vocabulary)
    settings.tracker.new_world_frames = 0;
  return settings;
}

std::vector<float> level_scales(const OrbExtractor& extractor) {
  std::vector<float> scales;
  for (int level = 0; level < extractor.levels(); ++level) scales.push_back(extractor.scale(level));
  return scales;
}
}  // namespace

Slam::Slam(const Camera& camera, const Options& options, Mode mode, std::shared_ptr<Segmenter> segmenter,
           std::shared_ptr<const Vocabulary> vocabulary)
    : camera_(validated(camera)),
      options_(validated(options)),
      mode_(mode),
      segmentation_(options.removal.labels ? std::move(segmenter) : nullptr, mode, options.threads),
      removal_(camera, options.removal_settings()),
      extractor_(options.orb),
      map_(level_scales(extractor_)),
      tracker_(camera, map_, tracker_settings(options, vocabulary != nullptr)),
      keyframe_policy_(options.keyframes),
      mapper_(camera, map_, map_mutex_, options.mapper_settings()),
      closing_([this](auto&&... work) { close_loops(work...); }, mode, kLoopPatience),
      mapping_([this](auto&&... work) { map_keyframe(work...); }, mode, 1) {
  if (vocabulary == nullptr || !options_.loop.enabled) return;
  places_.emplace(std::move(vocabulary));
  loop_closer_.emplace(camera_, map_, *places_, map_mutex_, options_.loop_settings());
}

void Slam::continue_from(SavedMap saved) {
  saved.require_fits(camera_, map_.scales());
  if (places_) saved.index(*places_);
  map_ = std::move(saved.map);
  map_.begin_flight();
}

void Slam::map_keyframe(KeyframeId keyframe, const KeyframeWorker::ShouldStop& should_stop,
                        StageTimes& times) {
  // The next keyframe matters more than the last step of refining this one.
  mapper_.process(keyframe, should_stop);
  const LocalMapper::Times& t = mapper_.times();
  times.add("mapping.landmarks", t.landmarks);
  times.add("mapping.fusion", t.fusion);
  times.add("mapping.bundle_adjustment", t.bundle);
  times.add("mapping.culling", t.culling);
  times.add("mapping", t.landmarks + t.fusion + t.bundle + t.culling);
  if (loop_closer_) closing_.submit(keyframe);
}

void Slam::close_loops(KeyframeId keyframe, const KeyframeWorker::ShouldStop& should_stop,
                       StageTimes& times) {
  const std::size_t closed = loop_closer_->closed().size();
  loop_closer_->process(keyframe, should_stop);
  const LoopCloser::Times& t = loop_closer_->times();
  times.add("loop.recognise", t.recognise);
  if (loop_closer_->closed().size() == closed) return;
  times.add("loop.correct", t.correct);
  times.add("loop.fuse", t.fuse);
  times.add("loop.bundle_adjustment", t.bundle);
}

// Called with the map's mutex held.
std::vector<KeyframeId> Slam::similar_keyframes(const ObservedFrame& view) const {
  std::vector<KeyframeId> result;
  if (!places_) return result;
  const auto lives = [this](KeyframeId id) { return map_.find(id) != nullptr; };
  for (const auto& found : places_->similar(places_->describe(view), lives)) result.push_back(found.keyframe);
  return result;
}

// After a loop the world lies elsewhere than where removal remembers it. Called with the map's mutex held.
void Slam::follow_correction() {
  if (followed_corrections_ == map_.corrections()) return;
  followed_corrections_ = map_.corrections();
  const auto corrected = tracker_.last_pose();
  if (corrected && last_T_camera_world_) {
    removal_.move_world(corrected->inverse() * *last_T_camera_world_);
    last_T_camera_world_ = corrected;
  }
}

// What removal remembers is of the world the camera was in. Called with the map's mutex held.
void Slam::follow_world(const TrackedFrame& frame) {
  if (!frame.T_camera_world) return;
  const bool is_other =
      last_reference_.is_valid() &&
      (!frame.reference.is_valid() || map_.world_of(frame.reference) != map_.world_of(last_reference_));
  if (is_other) removal_.leave_world();
  last_reference_ = frame.reference;
}

std::optional<FrameResult> Slam::process(const Frame& frame, const cv::Mat& mask) {
  if (records_.empty() && map_.keyframe_count() == 0 && !options_.keyframes.enabled)
    throw OptionsError("keyframes.enabled is false and there is no map to find the camera in; give one");
  if (!is_usable(frame)) return std::nullopt;
  const Stopwatch watch;
  FrameResult result;
  cv::Mat grey;
  cv::cvtColor(frame.colour, grey, cv::COLOR_BGR2GRAY);
  result.removal = find_movables(frame, grey);
  const double removal_seconds = watch.seconds();
  const auto view = extract(frame, grey, mask, result);
  const double extract_seconds = watch.seconds() - removal_seconds;

  const cv::Mat& removed = result.removal.mask;
  const double hidden_share =
      removed.empty() ? 0.0 : cv::countNonZero(removed) / static_cast<double>(removed.total());

  std::unique_lock map_lock(map_mutex_);
  FrameHint hint{result.removal.T_camera_world, hidden_share, [&] { return similar_keyframes(*view); }};
  if (followed_corrections_ != map_.corrections()) hint.T_camera_world.reset();  // of a world that is no more
  follow_correction();
  TrackedFrame tracked = tracker_.track(view, frame.timestamp, hint);
  tracked.hidden = count_hidden(tracked, removed);
  KeyframeId keyframe;
  const bool begins_world = tracked.T_camera_world && !tracked.reference.is_valid();
  const bool has_room = mapping_.waiting() < static_cast<std::size_t>(options_.threads.keyframe_queue);
  if ((has_room || begins_world) && keyframe_policy_.promotes(tracked, map_, mapping_.is_idle())) {
    keyframe = mapper_.insert(tracked, frame.index);
    keyframe_policy_.promoted(tracked);
    tracker_.promoted(keyframe);
    tracked.reference = keyframe;
  }
  record(tracked, frame.index);
  follow_world(tracked);
  if (tracked.reference.is_valid()) result.world = map_.world_of(tracked.reference);
  last_T_camera_world_ = tracked.T_camera_world ? tracked.T_camera_world : last_T_camera_world_;
  cull_contradicted(tracked, frame, result.removal);
  map_lock.unlock();

  const double seconds = watch.seconds();
  note_times(removal_seconds, extract_seconds, seconds);
  if (keyframe.is_valid()) mapping_.submit(keyframe);
  if (keyframe.is_valid()) hand_out(keyframe, frame, result.removal);

  result.index = frame.index;
  result.timestamp = frame.timestamp;
  result.state = tracked.state;
  result.inliers = last_inliers_ = tracked.inliers;
  result.trust = tracked.trust;
  result.is_keyframe = keyframe.is_valid();
  result.tracking_seconds = seconds;
  if (tracked.T_camera_world) result.T_world_camera = tracked.T_camera_world->inverse();
  if (removes()) {
    const bool is_measured = tracked.state == TrackingState::kTracking;
    removal_.remember(is_measured ? tracked.T_camera_world : std::nullopt, result.points,
                      result.removed_points);
  }
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

bool Slam::removes() const {
  return segmentation_.is_on() || options_.removal.free_space || options_.removal.flow;
}

Removal Slam::find_movables(const Frame& frame, const cv::Mat& grey) {
  if (!removes()) return {};
  std::optional<SE3> predicted;
  {
    const std::scoped_lock lock(map_mutex_);
    follow_correction();
    predicted = tracker_.predicted_pose(frame.timestamp);
  }
  const auto every = static_cast<std::size_t>(options_.removal.label_every);
  if (mode_ == Mode::kRealTime || frames() % every == 0) segmentation_.offer(frame.index, frame.colour);
  const auto labels = segmentation_.take();
  Removal removal = removal_.find(frame, grey, predicted, labels);
  // Labels that removal did not believe are not for the dense map either.
  if (labels && removal.label_age == static_cast<int>(frame.index - labels->index)) {
    labelled_index_ = labels->index;
    labels_ = labels->segmentation.labels;
  }
  return removal;
}

std::shared_ptr<const ObservedFrame> Slam::extract(const Frame& frame, const cv::Mat& grey,
                                                   const cv::Mat& mask, FrameResult& result) {
  cv::Mat forbidden = result.removal.mask;
  // Where little else is left, things that could move but rest will do for the moment.
  const bool is_scarce = frames() > 0 && last_inliers_ < options_.removal.scarce_points;
  const cv::Mat resting = is_scarce ? result.removal.resting : cv::Mat();
  if (!resting.empty()) forbidden = forbidden & ~resting;
  if (!mask.empty()) forbidden = forbidden.empty() ? mask : cv::Mat(forbidden | mask);
  const auto features = extractor_.extract(grey, forbidden, &result.removed_points);
  for (const auto& feature : features) result.points.push_back(feature.pixel);
  auto view =
      std::make_shared<ObservedFrame>(observe(features, frame.colour, frame.depth, camera_, options_.depth));
  if (!resting.empty()) {
    for (const auto& feature : features) {
      const cv::Point pixel(std::min(cvRound(feature.pixel.x), resting.cols - 1),
                            std::min(cvRound(feature.pixel.y), resting.rows - 1));
      view->is_movable.push_back(resting.at<std::uint8_t>(pixel) != 0);
    }
  }
  return view;
}

// What came into the map before it was known to move goes.
void Slam::cull_contradicted(const TrackedFrame& frame, const Frame& images, const Removal& removal) {
  if (!removes() || !options_.keyframes.enabled || frame.state != TrackingState::kTracking) return;
  cv::Mat moving;
  for (const auto& object : removal.objects) {
    if (moving.empty()) moving = cv::Mat::zeros(images.colour.size(), CV_8UC1);
    paint(object, moving);
  }
  roslam::cull_contradicted(map_, tracker_.local_landmarks(), camera_, *frame.T_camera_world,
                            {moving, images.depth}, options_.noise);
}

// Landmarks of the reference keyframe that would be seen where the mask is.
int Slam::count_hidden(const TrackedFrame& frame, const cv::Mat& mask) const {
  const Keyframe* reference = map_.find(frame.reference);
  if (mask.empty() || reference == nullptr || !frame.T_camera_world) return 0;
  int hidden = 0;
  for (const LandmarkId id : reference->landmarks) {
    const Landmark* landmark = map_.find(id);
    if (landmark == nullptr) continue;
    const Eigen::Vector3d point = *frame.T_camera_world * landmark->position;
    if (point.z() <= 0.0) continue;
    const Eigen::Vector2d pixel = camera_.distort(camera_.project(point));
    const int x = static_cast<int>(std::lround(pixel.x()));
    const int y = static_cast<int>(std::lround(pixel.y()));
    if (x >= 0 && y >= 0 && x < mask.cols && y < mask.rows && mask.at<std::uint8_t>(y, x) != 0) ++hidden;
  }
  return hidden;
}

void Slam::record(const TrackedFrame& frame, std::size_t index) {
  ++frames_by_state_[frame.state];
  Record record{index, frame.timestamp, {}, {}};
  if (frame.T_camera_world && frame.reference.is_valid()) {
    record.reference = frame.reference;
    record.T_camera_reference = *frame.T_camera_world * map_.T_camera_world(frame.reference).inverse();
  }
  records_.push_back(record);
}

void Slam::note_times(double removal, double extract, double total) {
  const Tracker::Times& t = tracker_.times();
  if (removes()) times_.add("tracking.removal", removal);
  times_.add("tracking.extract", extract);
  times_.add("tracking.match_frame", t.match_frame);
  times_.add("tracking.match_map", t.match_map);
  times_.add("tracking.optimise", t.optimise);
  times_.add("tracking.relocalise", t.relocalise);
  times_.add("tracking", total);
}

void Slam::finish() {
  // All, whatever the first throws: nobody may change the map any more when results are read.
  std::exception_ptr failure;
  const auto drain = [&](auto& worker) {
    try {
      worker.drain();
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  };
  drain(mapping_);
  drain(closing_);
  if (restoration_) drain(*restoration_);
  if (dense_) drain(*dense_);
  if (failure) std::rethrow_exception(failure);
}

}  // namespace roslam
