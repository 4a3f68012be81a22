// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/workers/dense_worker.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/common/stopwatch.hpp"
#include "roslam/common/thread_priority.hpp"
#include "roslam/dense/dense_mapper.hpp"
#include "roslam/dense/depth_keyframe.hpp"
#include "roslam/geometry/se3f.hpp"
#include "roslam/occupancy/live_occupancy.hpp"
#include "roslam/occupancy/occupancy_map.hpp"
#include "roslam/restoration/source_image.hpp"
#include "roslam/semantics/label_set.hpp"
#include "roslam/workers/keyframe_jobs.hpp"
#include "roslam/workers/keyframe_worker.hpp"

namespace roslam {

namespace {
constexpr int kRemovedStride = 6;      // pixels between two points of what was removed, at least
constexpr double kMostRemoved = 2000;  // points of a keyframe
constexpr double kInTheEnd = 0.25;     // of the distance that keyframes are followed from in flight
}  // namespace

struct DenseWorker::Impl {
  struct Job {
    DenseInput input;
    std::optional<RestoredImage> restored;
  };
  // A point on an object that was removed, in the camera frame of its keyframe.
  struct RemovedPoint {
    Eigen::Vector3f position;
    cv::Vec3b colour;
  };

  Impl(const Camera& camera, const Options& options, Mode the_mode, PoseLookup lookup, LoadControl* load);
  void queue(KeyframeId keyframe, Job job);
  void work(KeyframeId keyframe, const KeyframeWorker::ShouldStop& should_stop, StageTimes& times);
  void fuse(KeyframeId keyframe, const Job& job);
  std::vector<RemovedPoint> removed_points(const Frame& frame, const cv::Mat& hidden) const;
  std::map<KeyframeId, KeyframePose> poses_of(const std::vector<KeyframeId>& ids) const;
  void follow(double share);
  void add_occupancy(SubmapId submap, DenseMap& map) const;
  void keep_up(StageTimes& times);
  void keep_occupancy(const DenseChanges& changes, SubmapId submap, StageTimes& times);
  void make_checkpoint(StageTimes& times);
  std::optional<DenseMap> map_of(SubmapId submap, const std::function<bool()>& should_stop) const;

  DenseOptions options_;
  DepthOptions depth_;
  int margin_;  // pixels
  Mode mode_;
  PoseLookup pose_lookup_;
  LoadControl* load_;
  DepthKeyframeReducer reducer_;

  // Used by the worker's thread.
  DenseMapper mapper_;
  std::map<KeyframeId, std::vector<RemovedPoint>> removed_;
  std::size_t since_followed_ = 0;  // keyframes
  std::size_t moved_ = 0;
  LiveOccupancy live_occupancy_;
  bool keeps_occupancy_ = false, keeps_surface_ = false;  // since the keyframe before
  LiveSurface live_surface_;                              // may be used by all threads
  KeyframeId newest_;                                     // that was fused
  double newest_timestamp_ = 0.0;                         // seconds

  std::atomic<bool> is_corrected_ = false;  // as a whole, since the map was followed

  std::mutex mutex_;  // guards what follows
  std::map<KeyframeId, DenseInput> unrestored_;
  bool wants_occupancy_ = false;
  std::shared_ptr<const OccupancyGrid> occupancy_;
  std::optional<SubmapId> wanted_checkpoint_;
  std::shared_ptr<const DenseMap> checkpoint_;

  KeyframeJobs<Job> jobs_;

  KeyframeWorker worker_;  // last, so that its thread stops before the members it uses are destroyed
};

DenseWorker::Impl::Impl(const Camera& camera, const Options& options, Mode the_mode, PoseLookup lookup,
                        LoadControl* load)
    : options_(options.dense),
      depth_(options.depth),
      margin_(options.restoration.margin),
      mode_(the_mode),
      pose_lookup_(std::move(lookup)),
      load_(load),
      reducer_(camera, options.dense, options.depth),
      mapper_(options.dense, options.noise),
      live_occupancy_(options.dense),
      jobs_(options.dense.queue),
      worker_([this](auto&&... job) { work(job...); }, the_mode, 1, KeyframeWorker::OnFailure::kSwitchOff) {}

DenseWorker::DenseWorker(const Camera& camera, const Options& options, Mode mode, PoseLookup pose_lookup,
                         LoadControl* load)
    : impl_(std::make_unique<Impl>(camera, options, mode, std::move(pose_lookup), load)) {}

DenseWorker::~DenseWorker() = default;

void DenseWorker::submit(KeyframeId keyframe, DenseInput input) {
  if (!input.is_restored) return impl_->queue(keyframe, {std::move(input), std::nullopt});
  const std::scoped_lock lock(impl_->mutex_);
  impl_->unrestored_.emplace(keyframe, std::move(input));
}

void DenseWorker::restored(KeyframeId keyframe, const RestoredImage* image) {
  Impl::Job job;
  {
    const std::scoped_lock lock(impl_->mutex_);
    const auto found = impl_->unrestored_.find(keyframe);
    if (found == impl_->unrestored_.end()) return;
    job.input = std::move(found->second);
    impl_->unrestored_.erase(found);
  }
  if (image != nullptr) job.restored = {image->colour, image->depth, image->provenance, {}, {}};
  impl_->queue(keyframe, std::move(job));
}

void DenseWorker::Impl::queue(KeyframeId keyframe, Job job) {
  jobs_.put(keyframe, std::move(job));
  worker_.submit(keyframe);
}

void DenseWorker::Impl::work(KeyframeId keyframe, const KeyframeWorker::ShouldStop& /*should_stop*/,
                             StageTimes& times) {
  if (mode_ == Mode::kRealTime) lower_thread_priority(ThreadPriority::kLowest);
  if (load_ != nullptr) load_->wait_while(LoadMeasure::kDenseMapWaits);
  const auto job = jobs_.take(keyframe);
  if (!job) return;  // dropped
  try {
    const Stopwatch watch;
    fuse(keyframe, *job);
    times.add("dense.fuse", watch.seconds());
    ++since_followed_;
    if (is_corrected_.exchange(false) || since_followed_ >= static_cast<std::size_t>(options_.follow_every)) {
      const Stopwatch follow_watch;
      follow(1.0);
      times.add("dense.follow", follow_watch.seconds());
    }
    newest_ = keyframe;
    newest_timestamp_ = job->input.frame.timestamp;
    keep_up(times);
    make_checkpoint(times);
  } catch (const std::exception& error) {
    jobs_.note_fault(error);
  }
}

void DenseWorker::Impl::fuse(KeyframeId keyframe, const Job& job) {
  const Frame& frame = job.input.frame;
  const RestoredImage* restored = job.restored ? &*job.restored : nullptr;
  cv::Mat hidden;
  if (options_.remove) hidden = removed_area(job.input.dynamic_objects, frame.colour.size(), margin_);
  DepthKeyframe view = restored != nullptr
                           ? reducer_.reduce(restored->colour, restored->depth, restored->provenance, {})
                           : reducer_.reduce(frame.colour, frame.depth, {}, hidden);
  view.noise = job.input.depth_noise;
  if (!job.input.labels.empty()) {
    cv::Mat labels = job.input.labels;
    // What could move may since have left, and would give its class to what is behind it.
    if (job.input.has_older_labels) {
      labels = labels.clone();
      labels.setTo(kVoid, movable_mask(labels));
    }
    reducer_.label(view, labels, job.input.T_labelled_camera);
  }
  mapper_.insert(keyframe, view, pose_lookup_({keyframe}).front());
  if (!hidden.empty() && !frame.depth.empty()) removed_[keyframe] = removed_points(frame, hidden);
}

std::vector<DenseWorker::Impl::RemovedPoint> DenseWorker::Impl::removed_points(const Frame& frame,
                                                                               const cv::Mat& hidden) const {
  std::vector<RemovedPoint> result;
  const cv::Mat is_clear = clear_of_edges(frame.depth, depth_);
  const int stride = std::max(kRemovedStride, cvCeil(std::sqrt(cv::countNonZero(hidden) / kMostRemoved)));
  for (int y = 0; y < hidden.rows; y += stride) {
    for (int x = 0; x < hidden.cols; x += stride) {
      const float depth = frame.depth.at<float>(y, x);
      if (hidden.at<std::uint8_t>(y, x) == 0 || is_clear.at<std::uint8_t>(y, x) == 0) continue;
      if (depth > static_cast<float>(options_.max_depth)) continue;
      const Eigen::Vector3f point = reducer_.rays().point(x, y, depth);
      if (point.allFinite()) result.push_back({point, frame.colour.at<cv::Vec3b>(y, x)});
    }
  }
  return result;
}

// Tells what somebody has asked for of what changed. Who asks anew is told all.
void DenseWorker::Impl::keep_up(StageTimes& times) {
  bool wants_occupancy = false;
  {
    const std::scoped_lock lock(mutex_);
    wants_occupancy = wants_occupancy_;
  }
  const bool wants_surface = live_surface_.is_wanted();
  if (wants_occupancy != keeps_occupancy_ || wants_surface != keeps_surface_) mapper_.restart_changes();
  keeps_occupancy_ = wants_occupancy;
  keeps_surface_ = wants_surface;
  if (!wants_surface) live_surface_.clear();
  if (!wants_occupancy && !wants_surface) return;
  try {
    const Stopwatch watch;
    const SubmapId submap = pose_lookup_({newest_}).front().submap;
    const DenseChanges changes = mapper_.take_changes();
    if (wants_surface) {
      live_surface_.update(mapper_, changes, options_, submap);
      times.add("dense.surface", watch.seconds());
    }
    if (wants_occupancy) keep_occupancy(changes, submap, times);
  } catch (...) {
    mapper_.restart_changes();  // what was taken is lost
    throw;
  }
}

void DenseWorker::Impl::keep_occupancy(const DenseChanges& changes, SubmapId submap, StageTimes& times) {
  const Stopwatch watch;
  live_occupancy_.update(mapper_, changes);
  auto grid = live_occupancy_.grid(submap, newest_timestamp_);
  times.add("dense.occupancy", watch.seconds());
  const std::scoped_lock lock(mutex_);
  if (grid) occupancy_ = std::move(grid);
}

std::map<KeyframeId, KeyframePose> DenseWorker::Impl::poses_of(const std::vector<KeyframeId>& ids) const {
  std::map<KeyframeId, KeyframePose> result;
  const std::vector<KeyframePose> poses = pose_lookup_(ids);
  for (std::size_t i = 0; i < ids.size(); ++i) result.emplace(ids[i], poses[i]);
  return result;
}

void DenseWorker::Impl::follow(double share) {
  since_followed_ = 0;
  moved_ += mapper_.follow(poses_of(mapper_.keyframes()), share, [this] { return worker_.is_cancelled(); });
}

// Where somebody has asked for it. A cancelled one leaves the one before.
void DenseWorker::Impl::make_checkpoint(StageTimes& times) {
  std::optional<SubmapId> submap;
  {
    const std::scoped_lock lock(mutex_);
    submap = std::exchange(wanted_checkpoint_, std::nullopt);
  }
  if (!submap) return;
  const Stopwatch watch;
  auto map = map_of(*submap, [this] { return worker_.is_cancelled(); });
  times.add("dense.checkpoint", watch.seconds());
  if (!map) return;
  const std::scoped_lock lock(mutex_);
  checkpoint_ = std::make_shared<const DenseMap>(std::move(*map));
}

void DenseWorker::follow_soon() { impl_->is_corrected_ = true; }

void DenseWorker::drain() {
  impl_->worker_.drain();
  if (!impl_->worker_.is_cancelled()) impl_->follow(kInTheEnd);
}

std::shared_ptr<const OccupancyGrid> DenseWorker::occupancy() {
  const std::scoped_lock lock(impl_->mutex_);
  impl_->wants_occupancy_ = true;
  return impl_->occupancy_;
}

SurfaceChanges DenseWorker::surface_changes(SubmapId submap, std::uint64_t revision,
                                            std::size_t most_points) {
  return impl_->live_surface_.since(submap, revision, most_points);
}

std::shared_ptr<const DenseMap> DenseWorker::checkpoint(SubmapId submap) {
  const std::scoped_lock lock(impl_->mutex_);
  impl_->wanted_checkpoint_ = submap;
  return std::exchange(impl_->checkpoint_, nullptr);
}

void DenseWorker::cancel() { impl_->worker_.cancel(); }

StageTimes DenseWorker::times() const { return impl_->worker_.times(); }

// A map that reaches too far for the cells is a map all the same.
void DenseWorker::Impl::add_occupancy(SubmapId submap, DenseMap& map) const {
  if (map.surface.points.empty()) return;
  try {
    map.occupancy = std::make_shared<const OccupancyMap>(
        occupancy_map_of(mapper_, submap, map.surface, usual_resolution(mapper_.voxel_size())));
  } catch (const OptionsError& error) {
    ++map.faults[std::string("no dense.bt: ") + error.what()];
  }
}

std::optional<DenseMap> DenseWorker::Impl::map_of(SubmapId submap,
                                                  const std::function<bool()>& should_stop) const {
  DenseMap map;
  auto surface = mapper_.surface(submap, should_stop);
  if (!surface) return std::nullopt;
  map.surface = std::move(*surface);
  map.voxel_size = mapper_.voxel_size();
  map.times_coarsened = mapper_.times_coarsened();
  map.keyframes = mapper_.keyframes().size();
  map.moved = moved_;
  map.voxel_bytes = mapper_.voxel_bytes();
  map.view_bytes = mapper_.view_bytes();
  std::vector<KeyframeId> ids;
  for (const auto& [id, points] : removed_) ids.push_back(id);
  for (const auto& [id, pose] : poses_of(ids)) {
    if (pose.submap != submap) continue;
    const SE3f world_from_camera(pose.T_world_camera);
    for (const auto& point : removed_.at(id))
      map.removed.push_back({world_from_camera * point.position, Eigen::Vector3f::Zero(), point.colour});
  }
  return map;
}

std::optional<DenseMap> DenseWorker::result(SubmapId submap, const std::stop_token& stop) const {
  auto map = impl_->map_of(submap, [&] { return stop.stop_requested(); });
  if (!map) return std::nullopt;
  if (!stop.stop_requested()) impl_->add_occupancy(submap, *map);
  map->dropped = impl_->jobs_.dropped();
  for (const auto& [fault, count] : impl_->jobs_.faults()) map->faults[fault] += count;
  for (const auto& [fault, count] : impl_->worker_.faults()) map->faults[fault] += count;
  return map;
}

}  // namespace roslam
