// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/pipeline/dense_worker.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <utility>

#include "roslam/error.hpp"
#include "roslam/geometry/motion.hpp"
#include "roslam/geometry/stopwatch.hpp"
#include "roslam/pipeline/thread_priority.hpp"
#include "roslam/restoration/view.hpp"
#include "roslam/semantics/label_set.hpp"

namespace roslam {

namespace {
constexpr int kRemovedStride = 6;      // pixels between two points of what was removed, at least
constexpr double kMostRemoved = 2000;  // points of a keyframe
constexpr double kInTheEnd = 0.25;     // of the distance that keyframes are followed from in flight
}  // namespace

std::string_view why_empty(const DenseMap& map) {
  if (map.keyframes > 0) return "nothing within dense.max_depth was seen often enough";
  if (map.dropped > 0 || !map.faults.empty()) return "all keyframes were dropped or failed";
  return "no keyframe has depth within dense.max_depth";
}

DenseWorker::DenseWorker(const Camera& camera, const Options& options, Mode mode, PlacesOf places_of)
    : options_(options.dense),
      depth_(options.depth),
      margin_(options.restoration.margin),
      mode_(mode),
      places_of_(std::move(places_of)),
      reducer_(camera, options.dense, options.depth),
      mapper_(options.dense, options.noise),
      jobs_(options.dense.queue),
      worker_([this](KeyframeId keyframe, const auto&, StageTimes& times) { work(keyframe, times); }, mode,
              1) {}

void DenseWorker::submit(KeyframeId keyframe, DenseKeyframe input) {
  if (!input.is_restored) return queue(keyframe, {std::move(input), std::nullopt});
  const std::scoped_lock lock(mutex_);
  unrestored_.emplace(keyframe, std::move(input));
}

void DenseWorker::restored(KeyframeId keyframe, const RestoredView* view) {
  Job job;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = unrestored_.find(keyframe);
    if (found == unrestored_.end()) return;
    job.input = std::move(found->second);
    unrestored_.erase(found);
  }
  if (view != nullptr) job.restored = {view->colour, view->depth, view->provenance, {}, {}};
  queue(keyframe, std::move(job));
}

void DenseWorker::queue(KeyframeId keyframe, Job job) {
  jobs_.put(keyframe, std::move(job));
  worker_.submit(keyframe);
}

void DenseWorker::work(KeyframeId keyframe, StageTimes& times) {
  if (mode_ == Mode::kRealTime) give_way_to_others();
  const auto job = jobs_.take(keyframe);
  if (!job) return;  // dropped
  try {
    const Stopwatch watch;
    fuse(keyframe, *job);
    times.add("dense.fuse", watch.seconds());
    if (++since_followed_ < static_cast<std::size_t>(options_.follow_every)) return;
    const Stopwatch follow_watch;
    follow(1.0);
    times.add("dense.follow", follow_watch.seconds());
  } catch (const std::exception& error) {
    jobs_.note_fault(error);
  }
}

void DenseWorker::fuse(KeyframeId keyframe, const Job& job) {
  const Frame& frame = job.input.frame;
  const RestoredView* restored = job.restored ? &*job.restored : nullptr;
  cv::Mat hidden;
  if (options_.remove) hidden = removed_area(job.input.removal, frame.colour.size(), margin_);
  DenseView view = restored != nullptr
                       ? reducer_.reduce(restored->colour, restored->depth, restored->provenance, {})
                       : reducer_.reduce(frame.colour, frame.depth, {}, hidden);
  if (!job.input.labels.empty()) {
    cv::Mat labels = job.input.labels;
    // What could move may since have left, and would give its class to what is behind it.
    if (job.input.has_older_labels) {
      labels = labels.clone();
      labels.setTo(kVoid, movable_mask(labels));
    }
    reducer_.label(view, labels, job.input.T_labelled_camera);
  }
  mapper_.insert(keyframe, view, places_of_({keyframe}).front());
  if (!hidden.empty() && !frame.depth.empty()) removed_[keyframe] = removed_points(frame, hidden);
}

std::vector<DenseWorker::RemovedPoint> DenseWorker::removed_points(const Frame& frame,
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

std::map<KeyframeId, KeyframePlace> DenseWorker::places(const std::vector<KeyframeId>& ids) const {
  std::map<KeyframeId, KeyframePlace> result;
  const std::vector<KeyframePlace> places = places_of_(ids);
  for (std::size_t i = 0; i < ids.size(); ++i) result.emplace(ids[i], places[i]);
  return result;
}

void DenseWorker::follow(double share) {
  since_followed_ = 0;
  moved_ += mapper_.follow(places(mapper_.keyframes()), share);
}

void DenseWorker::drain() {
  worker_.drain();
  follow(kInTheEnd);
}

// A map that reaches too far for the cells is a map all the same.
void DenseWorker::add_occupancy(WorldId world, DenseMap& map) const {
  if (map.surface.points.empty()) return;
  try {
    map.occupancy = std::make_shared<const Occupancy>(
        occupancy_of(mapper_, world, map.surface, usual_resolution(mapper_.voxel_size())));
  } catch (const OptionsError& error) {
    ++map.faults[std::string("no dense.bt: ") + error.what()];
  }
}

DenseMap DenseWorker::result(WorldId world) const {
  DenseMap map;
  map.surface = mapper_.surface(world);
  map.voxel_size = mapper_.voxel_size();
  map.times_coarsened = mapper_.times_coarsened();
  map.keyframes = mapper_.keyframes().size();
  map.moved = moved_;
  map.voxel_bytes = mapper_.voxel_bytes();
  map.view_bytes = mapper_.view_bytes();
  std::vector<KeyframeId> ids;
  for (const auto& [id, points] : removed_) ids.push_back(id);
  for (const auto& [id, place] : places(ids)) {
    if (place.world != world) continue;
    const Motion world_from_camera(place.T_world_camera);
    for (const RemovedPoint& point : removed_.at(id))
      map.removed.push_back({world_from_camera * point.position, Eigen::Vector3f::Zero(), point.colour});
  }
  map.dropped = jobs_.dropped();
  map.faults = jobs_.faults();
  add_occupancy(world, map);
  return map;
}

}  // namespace roslam
