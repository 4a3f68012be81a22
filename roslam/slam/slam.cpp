// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/slam.hpp"

#include <utility>

#include "roslam/common/error.hpp"
#include "roslam/options/settings.hpp"
#include "roslam/slam/slam_impl.hpp"

namespace roslam {

namespace {
constexpr const char* kReading = "reading of results";
}

Slam::Slam(const Camera& camera, const Options& options, Mode mode, std::shared_ptr<Segmenter> segmenter,
           std::shared_ptr<const Vocabulary> vocabulary)
    : impl_(std::make_unique<Impl>(camera, options, mode, segmenter, std::move(vocabulary))) {
  if (segmenter) impl_->backends["segmentation"] = segmenter->backend();
}

Slam::~Slam() { impl_->cancel(); }

void Slam::load_map(SavedMap saved) {
  saved.require_fits(impl_->camera, impl_->map.scales());
  if (impl_->keyframe_database) saved.index(*impl_->keyframe_database);
  impl_->map = std::move(saved.map);
  impl_->map.begin_session();
  impl_->poses.publish(impl_->map);
}

void Slam::set_initial_pose(const SE3& T_world_body) {
  if (!T_world_body.is_finite()) throw UsageError("set_initial_pose: the pose is not finite");
  if (impl_->map.session() > 0)
    throw UsageError("set_initial_pose: the map that was loaded has a frame of its own");
  if (impl_->log.frames() > 0) throw UsageError("set_initial_pose: call it before the first frame");
  impl_->level.set_initial_pose(T_world_body);
}

void Slam::enable_dense_mapping() {
  Impl& impl = *impl_;
  impl.dense.emplace(
      impl.camera, impl.options, impl.mode,
      [&impl](const auto& keyframes) { return impl.poses.find(keyframes); }, &impl.load);
}

void Slam::enable_restoration(std::shared_ptr<Inpainter> inpainter, OnRestored on_restored) {
  Impl& impl = *impl_;
  if (inpainter) impl.backends["inpainting"] = inpainter->backend();
  const auto hand_to_dense = [&impl](KeyframeId keyframe, const RestoredImage* image) {
    if (impl.dense) impl.dense->restored(keyframe, image);
  };
  impl.restoration.emplace(
      impl.camera, impl.options, impl.mode, std::move(inpainter),
      [&impl](const auto& keyframes) { return impl.poses.find(keyframes); },
      [hand_to_dense, on_restored = std::move(on_restored)](const RestoredKeyframe& restored) {
        hand_to_dense(restored.keyframe, &restored.view);
        if (on_restored) on_restored(restored);
      },
      [hand_to_dense](KeyframeId keyframe) { hand_to_dense(keyframe, nullptr); }, &impl.load);
}

void Slam::on_frame(OnFrame callback) { impl_->on_frame = std::move(callback); }

void Slam::on_map_changed(OnMapChanged callback) { impl_->on_map_changed = std::move(callback); }

FrameResult Slam::process(const Frame& frame, const cv::Mat& mask) {
  if (impl_->callbacks.is_inside()) throw UsageError("Slam::process must not be called by a callback");
  return impl_->process(frame, mask);
}

void Slam::finish() {
  if (impl_->callbacks.is_inside()) throw UsageError("Slam::finish must not be called by a callback");
  impl_->finish();
}

void Slam::cancel() { impl_->cancel(); }

Trajectory Slam::trajectory() const { return impl_->live.trajectory(); }

Trajectory Slam::keyframes() const {
  const MapLock lock(impl_->map_mutex, kReading);
  return impl_->map.trajectory(impl_->map.session(), impl_->log.main_submap(impl_->map));
}

SubmapId Slam::main_submap() const {
  const MapLock lock(impl_->map_mutex, kReading);
  return impl_->log.main_submap(impl_->map);
}

bool Slam::found_in_loaded_map() const {
  const MapLock lock(impl_->map_mutex, kReading);
  return impl_->log.found_in_loaded_map(impl_->map);
}

std::map<SubmapId, std::size_t> Slam::frames_in_other_submaps() const {
  const MapLock lock(impl_->map_mutex, kReading);
  auto frames = impl_->log.frames_by_submap(impl_->map);
  frames.erase(impl_->log.main_submap(impl_->map));
  return frames;
}

std::set<SubmapId> Slam::submaps_on_objects() const {
  const MapLock lock(impl_->map_mutex, kReading);
  return impl_->log.submaps_on_objects(impl_->map);
}

const Map& Slam::map() const { return impl_->map; }

std::shared_ptr<const MapSnapshot> Slam::snapshot() const { return impl_->live.snapshot(); }

SavedMap Slam::saved_map() const {
  return SavedMap::of(impl_->camera, impl_->map,
                      impl_->keyframe_database ? &*impl_->keyframe_database : nullptr, impl_->map_mutex,
                      submaps_on_objects());
}

std::shared_ptr<const OccupancyGrid> Slam::occupancy() const {
  return impl_->dense ? impl_->dense->occupancy() : nullptr;
}

SurfaceChanges Slam::surface_changes(SubmapId submap, std::uint64_t revision, std::size_t most_points) const {
  return impl_->dense ? impl_->dense->surface_changes(submap, revision, most_points) : SurfaceChanges{};
}

std::optional<DenseMap> Slam::dense_map(const std::stop_token& stop) const {
  if (!impl_->dense) return std::nullopt;
  auto map = impl_->dense->result(main_submap(), stop);
  if (map && impl_->stereo_depth) {
    map->dropped += impl_->stereo_depth->dropped();
    map->faults = sum(map->faults, impl_->stereo_depth->faults());
  }
  return map;
}

std::shared_ptr<const DenseMap> Slam::dense_checkpoint() const {
  return impl_->dense ? impl_->dense->checkpoint(main_submap()) : nullptr;
}

std::vector<ClosedLoop> Slam::loops() const {
  const MapLock lock(impl_->map_mutex, kReading);
  return impl_->loop_closer ? impl_->loop_closer->closed() : std::vector<ClosedLoop>{};
}

std::size_t Slam::refused_loops() const {
  const MapLock lock(impl_->map_mutex, kReading);
  return impl_->loop_closer ? impl_->loop_closer->refused() : 0;
}

std::map<std::string, std::size_t> Slam::loop_faults() const { return impl_->closing.faults(); }

bool Slam::restores() const { return impl_->restoration.has_value(); }

std::size_t Slam::unrestored() const { return impl_->restoration ? impl_->restoration->dropped() : 0; }

std::map<std::string, std::size_t> Slam::restoration_faults() const {
  return impl_->restoration ? impl_->restoration->faults() : std::map<std::string, std::size_t>{};
}

std::map<std::string, std::size_t> Slam::labelling_faults() const { return impl_->front_end.faults(); }

std::map<std::string, std::size_t> Slam::gave_way() const { return impl_->load.frames(); }

std::map<std::string, std::string> Slam::backends() const { return impl_->backends; }

std::map<std::string, std::size_t> Slam::warnings() const {
  auto warnings = impl_->front_end.warnings();
  if (impl_->warned_of_gyroscope) warnings[kGyroscopeContradicts] = 1;
  return warnings;
}

const Camera& Slam::camera() const { return impl_->camera; }
const Options& Slam::options() const { return impl_->options; }
Mode Slam::mode() const { return impl_->mode; }

std::size_t Slam::frames() const { return impl_->log.frames(); }
const std::map<TrackingState, std::size_t>& Slam::frames_by_state() const { return impl_->log.by_state(); }
const std::map<RejectReason, std::size_t>& Slam::rejected() const { return impl_->log.rejected(); }
std::size_t Slam::clock_resets() const { return impl_->log.clock_resets(); }

std::size_t Slam::withdrawn_poses() const { return impl_->log.withdrawn(); }

MeasurementNoise Slam::measurement_noise() const { return impl_->front_end.noise().of_features(); }

std::map<std::string, std::size_t> Slam::doubted_poses() const {
  std::map<std::string, std::size_t> doubted;
  for (const auto& [doubt, count] : impl_->tracker.doubts()) doubted[std::string(describe(doubt))] = count;
  return doubted;
}

std::optional<GyroscopeState> Slam::gyroscope() const {
  const auto& gyroscope = impl_->tracker.gyroscope();
  return gyroscope ? std::make_optional(gyroscope->state()) : std::nullopt;
}

StageTimes Slam::times() const {
  StageTimes all = impl_->times;
  all.add_all(impl_->mapping.times());
  all.add_all(impl_->closing.times());
  all.add_all(impl_->front_end.times());
  if (impl_->stereo_depth) all.add_all(impl_->stereo_depth->times());
  if (impl_->restoration) all.add_all(impl_->restoration->times());
  if (impl_->dense) all.add_all(impl_->dense->times());
  return all;
}

const StageTimes& Slam::latency() const { return impl_->latency; }
MapLockTimes Slam::lock_times() const { return impl_->map_mutex.times(); }
std::size_t Slam::dropped_callbacks() const { return impl_->callbacks.dropped(); }
std::map<std::string, std::size_t> Slam::callback_faults() const { return impl_->callbacks.faults(); }

}  // namespace roslam
