// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/common/stage_times.hpp"
#include "roslam/dense/dense_map.hpp"
#include "roslam/dense/live_surface.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/loop_closing/closed_loop.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/map_io/saved_map.hpp"
#include "roslam/occupancy/occupancy_grid.hpp"
#include "roslam/options/options.hpp"
#include "roslam/restoration/inpainter.hpp"
#include "roslam/semantics/segmenter.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/slam/frame_result.hpp"
#include "roslam/slam/map_snapshot.hpp"
#include "roslam/workers/restored_keyframe.hpp"

namespace roslam {

/// Takes the result of each frame; a copy of the map's changes after each keyframe, loop and the like.
using OnFrame = std::function<void(const FrameResult&)>;
using OnMapChanged = std::function<void(const MapChange&)>;

/// The pipeline: frames in, trajectory and map out. open_slam() makes one with all its parts.
///
/// Threads: process(), finish() and what configures are called from one thread. snapshot(), saved_map(),
/// trajectory(), occupancy(), keyframes(), main_submap() and the other functions of submaps, loops(),
/// lock_times() and cancel() may be called from any thread at any time, and hold the map for a millisecond or
/// two at a time. All others give results of the thread that calls process(), map() and dense_map() only
/// after finish() in real-time mode.
///
/// Callbacks are called on a thread of their own in real-time mode, and so cost the tracker nothing, however
/// long they take: of more than 64 that wait the oldest are dropped and counted. In deterministic mode they
/// are called by process(). They may call what may be called from any thread. What they throw is counted.
class ROSLAM_EXPORT Slam {
 public:
  /// segmenter: labels frames on a thread of its own, null: none. vocabulary: for place recognition, null:
  /// neither loops are closed nor submaps merged. Throws CalibrationError or OptionsError.
  Slam(const Camera& camera, const Options& options = {}, Mode mode = Mode::kDeterministic,
       std::shared_ptr<Segmenter> segmenter = nullptr,
       std::shared_ptr<const Vocabulary> vocabulary = nullptr);

  /// Discards what is queued. Call finish() first to have it processed.
  ~Slam();
  Slam(const Slam&) = delete;
  Slam& operator=(const Slam&) = delete;

  /// Continues the map of an earlier session: the camera is localised in it. Call before the first frame.
  /// Throws InputError if the map was made with another camera or other pyramid levels.
  void load_map(SavedMap saved);

  /// The pose of the body at the first frame, in place of a level one in the origin. The world is that of
  /// this pose, and gravity does not turn it. Call before the first frame. Throws UsageError if it is not
  /// finite, later, or after load_map().
  void set_initial_pose(const SE3& T_world_body);

  /// on_frame: takes each frame's result. on_map_changed: takes what changed. Call before the first frame.
  void on_frame(OnFrame callback);
  void on_map_changed(OnMapChanged callback);

  /// Fuses keyframes into a dense map from now on, in real-time mode on another thread; restored keyframes,
  /// if enable_restoration() is called as well. Call before the first frame. Throws OptionsError in a library
  /// without the component dense.
  void enable_dense_mapping();

  /// Restores each keyframe from now on and hands it out, in real-time mode on another thread. inpainter:
  /// fills what no frame shows, null: a diffusion method does. on_restored: may be empty. Call before the
  /// first frame.
  void enable_restoration(std::shared_ptr<Inpainter> inpainter, OnRestored on_restored = {});

  /// Tracks a frame and, if it becomes a keyframe, maps it (in real-time mode: on another thread). mask:
  /// empty, or CV_8UC1 of the frame's size, nonzero where no feature may be extracted, in addition to dynamic
  /// objects. The images of the frame must not be changed afterwards: keyframes are processed later. A frame
  /// that cannot be used is counted, and the result says why. Throws what the mapping thread threw, and
  /// MemoryError.
  FrameResult process(const Frame& frame, const cv::Mat& mask = {});

  /// Waits for mapping, loop closing and all other stages. Call before reading results. Throws what mapping
  /// threw.
  void finish();

  /// Makes finish() return soon: queues are discarded and optimisations in progress end at their next
  /// iteration, with what they have reached. No keyframe is mapped and no image labelled any more. May be
  /// called from any thread.
  void cancel();

  /// Poses of all frames tracked in the main submap, with all later corrections of the map, in the order of
  /// frames. Poses that were predicted while dynamic objects hid the scene are interpolated between the
  /// measured ones before and after them.
  Trajectory trajectory() const;

  /// Poses of this session's keyframes in the main submap that are still in the map.
  Trajectory keyframes() const;

  /// Of several submaps that were never merged: one of the map that was loaded, if a frame was tracked in it;
  /// else the one with most tracked frames.
  SubmapId main_submap() const;

  /// True if a frame was tracked in the map that was loaded; the main submap is then of that map.
  bool found_in_loaded_map() const;

  /// Frames tracked in each submap other than the main one.
  std::map<SubmapId, std::size_t> frames_in_other_submaps() const;

  /// Submaps, other than the main one, that were mapped on dynamic objects; saved_map() leaves them out.
  std::set<SubmapId> submaps_on_objects() const;

  const Map& map() const;

  /// The sparse map and the path as they are now, or were a tenth of a second ago: readers share it.
  std::shared_ptr<const MapSnapshot> snapshot() const;

  /// A copy of the map, for save_map().
  SavedMap saved_map() const;

  /// Free, occupied and unknown space around the path so far, for a planner; kept up from the first call on,
  /// so that the first returns null, as all do where no dense map is made. OccupancyGrid::timestamp() says
  /// how old it is. May be called from any thread.
  std::shared_ptr<const OccupancyGrid> occupancy() const;

  /// What changed in the surfaces of the dense map since a revision of a submap, both as the call before
  /// gave them, for displays: of most_points at most, unless it is one block. They are kept up while somebody
  /// asks at least every ten seconds, from one keyframe to the next. May be called from any thread.
  SurfaceChanges surface_changes(SubmapId submap = {}, std::uint64_t revision = 0,
                                 std::size_t most_points = SIZE_MAX) const;

  /// The dense map of the main submap; nothing if none is made, or if stop was requested before it was
  /// extracted.
  std::optional<DenseMap> dense_map(const std::stop_token& stop = {}) const;

  /// The dense map of the main submap in flight, to be saved from time to time: each call asks for one, which
  /// is made with the next keyframe, and returns the one that the call before asked for; null if there is
  /// none yet. May be called from any thread.
  std::shared_ptr<const DenseMap> dense_checkpoint() const;

  /// Loops that were closed so far, how many were rejected, and what failed, by message.
  std::vector<ClosedLoop> loops() const;
  std::size_t refused_loops() const;
  std::map<std::string, std::size_t> loop_faults() const;

  bool restores() const;
  /// Keyframes that there was no time to restore, and what failed with others, by message.
  std::size_t unrestored() const;
  std::map<std::string, std::size_t> restoration_faults() const;

  /// What failed in labelling so far, by message.
  std::map<std::string, std::size_t> labelling_faults() const;

  /// What gave way to tracking in real-time mode, in words, and in how many frames.
  std::map<std::string, std::size_t> gave_way() const;

  /// What runs each network: segmentation and inpainting, such as "own (AVX2)".
  std::map<std::string, std::string> backends() const;

  /// What is doubtful about the input so far, in words with the remedy, and in how many frames: dark images,
  /// depth that does not belong to the colour images or is of an implausible scale, a calibration of another
  /// size.
  std::map<std::string, std::size_t> warnings() const;

  const Camera& camera() const;
  const Options& options() const;
  Mode mode() const;

  /// Frames that were used, these by state, and those that were not by reason.
  std::size_t frames() const;
  const std::map<TrackingState, std::size_t>& frames_by_state() const;
  const std::map<RejectReason, std::size_t>& rejected() const;

  /// How often the source's clock was found to have restarted.
  std::size_t clock_resets() const;

  /// How many estimated poses were not taken for the true ones, by reason (PlausibilityOptions, too few
  /// inliers). Another pose may have been found for the same frame.
  std::map<std::string, std::size_t> doubted_poses() const;

  /// Frames whose poses were given out and withdrawn, as a later frame contradicted them.
  std::size_t withdrawn_poses() const;

  /// The noise of features as it is now assumed or estimated (MeasurementNoise::estimate).
  MeasurementNoise measurement_noise() const;

  /// The gyroscope by the images so far; nothing if Camera::imu is not set.
  std::optional<GyroscopeState> gyroscope() const;

  /// Processor time of every stage so far.
  StageTimes times() const;

  /// Wall time of every frame from its receipt to its result: stage "latency".
  const StageTimes& latency() const;

  /// How long the map was held, by what was done meanwhile, and how long the tracker waited for it at most.
  MapLockTimes lock_times() const;

  /// Callbacks that were dropped as those before them took too long, and what they threw, by message.
  std::size_t dropped_callbacks() const;
  std::map<std::string, std::size_t> callback_faults() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace roslam
