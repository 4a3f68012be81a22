// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "roslam/atlas/saved_map.hpp"
#include "roslam/features/orb_extractor.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/loop/loop_closer.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/mapping/local_mapper.hpp"
#include "roslam/pipeline/dense_worker.hpp"
#include "roslam/pipeline/keyframe_worker.hpp"
#include "roslam/pipeline/options.hpp"
#include "roslam/pipeline/restoration_worker.hpp"
#include "roslam/pipeline/segmentation_worker.hpp"
#include "roslam/pipeline/statistics.hpp"
#include "roslam/removal/dynamic_removal.hpp"
#include "roslam/sources/frame_source.hpp"
#include "roslam/tracking/keyframe_policy.hpp"
#include "roslam/tracking/tracker.hpp"

namespace roslam {

/// What became of a frame.
struct FrameResult {
  std::size_t index = 0;   ///< of the frame in its source
  double timestamp = 0.0;  ///< seconds
  TrackingState state = TrackingState::kInitialising;
  std::optional<SE3> T_world_camera;  ///< as known now; later corrections show in Slam::trajectory()
  WorldId world;                      ///< that the pose is in; a world that is met again becomes one with it
  int inliers = 0;                    ///< landmarks the pose rests on
  double trust = 0.0;                 ///< in the pose, 0 (predicted or unknown) to 1
  bool is_keyframe = false;
  double tracking_seconds = 0.0;            ///< processor time of the tracking thread
  Removal removal;                          ///< what was found to move
  std::vector<cv::Point2f> points;          ///< corners that were used, pixels of the image as taken
  std::vector<cv::Point2f> removed_points;  ///< corners that would have been, but for the removal
};

/// The pipeline: frames in, trajectory and map out.
class Slam {
 public:
  /// segmenter: labels frames on a thread of its own, null: none. vocabulary: places are recognised by its
  /// words, null: no loop is closed. Throws CalibrationError or OptionsError.
  Slam(const Camera& camera, const Options& options = {}, Mode mode = Mode::kDeterministic,
       std::shared_ptr<Segmenter> segmenter = nullptr,
       std::shared_ptr<const Vocabulary> vocabulary = nullptr);

  /// Goes on from a map of an earlier flight: the camera is searched for in it. Call before the first frame.
  /// Throws InputError if the map was made with another camera or other pyramid levels.
  void continue_from(SavedMap saved);

  /// Fuses keyframes into a dense map from now on, in real-time mode on another thread: restored, if
  /// restore_keyframes is called as well. Call before the first frame.
  void map_densely();

  /// Restores each keyframe from now on and hands it out, in real-time mode on another thread. inpainter:
  /// paints what nobody saw, null: a classic method does. on_restored may be empty. Call before the first
  /// frame.
  void restore_keyframes(std::shared_ptr<Inpainter> inpainter,
                         RestorationWorker::OnRestored on_restored = {});

  /// Keyframes that there was no time to restore, and what went wrong with others, in words.
  bool restores() const { return restoration_.has_value(); }
  std::size_t unrestored() const { return restoration_ ? restoration_->dropped() : 0; }
  std::map<std::string, std::size_t> restoration_faults() const;

  /// A copy of the map, for save_map. In real-time mode only after finish().
  SavedMap snapshot() const;

  /// Tracks a frame and, if it becomes a keyframe, maps it (in real-time mode: on another thread). mask:
  /// empty, or CV_8UC1 of the frame's size, nonzero where nothing may be used, beside what is found to move.
  /// The images of the frame must not be changed afterwards: keyframes are worked on later.
  /// Frames that cannot be used (wrong size or type, time not increasing) give nothing and are counted.
  /// Throws OptionsError if there is no map and keyframes.enabled is false.
  std::optional<FrameResult> process(const Frame& frame, const cv::Mat& mask = {});

  /// Waits for mapping, loop closing and all that goes on beside. Call before reading results.
  void finish();

  /// Of several worlds that never met, that of the map the flight went on from, if the flight was in it; else
  /// the one with most tracked frames.
  WorldId main_world() const;

  /// True if a frame was tracked in the map that the flight went on from; the main world is then of that map.
  bool has_met_map() const;

  /// Poses of all frames tracked in the main world, with every later correction of the map, in the order of
  /// time.
  Trajectory trajectory() const;

  /// Poses of this flight's keyframes in the main world that are still in the map.
  Trajectory keyframes() const;

  /// Frames tracked in each other world.
  std::map<WorldId, std::size_t> frames_apart() const;

  /// The map. In real-time mode only after finish().
  const Map& map() const { return map_; }

  /// The dense map of the main world; nothing if none is made. Only after finish().
  std::optional<DenseMap> dense_map() const;

  /// Loops that were closed so far, and how many were refused. In real-time mode only after finish().
  std::vector<ClosedLoop> loops() const;
  std::size_t refused_loops() const;

  const Camera& camera() const { return camera_; }
  const Options& options() const { return options_; }
  Mode mode() const { return mode_; }

  /// Frames by state, and frames that could not be used by reason.
  const std::map<TrackingState, std::size_t>& frames_by_state() const { return frames_by_state_; }
  const std::map<std::string, std::size_t>& rejected() const { return rejected_; }
  std::size_t frames() const { return records_.size(); }

  /// What went wrong with labelling so far, in words, and how often.
  std::map<std::string, std::size_t> labelling_faults() const;

  /// Processor time of every stage so far.
  StageTimes times() const;

 private:
  // The pose of a frame hangs on a keyframe, so that corrections of the map move it too.
  struct Record {
    std::size_t index;  // of the frame in its source
    double timestamp;
    KeyframeId reference;  // none: not tracked
    SE3 T_camera_reference;
  };

  void map_keyframe(KeyframeId keyframe, const KeyframeWorker::ShouldStop& should_stop, StageTimes& times);
  void close_loops(KeyframeId keyframe, const KeyframeWorker::ShouldStop& should_stop, StageTimes& times);
  std::vector<KeyframeId> similar_keyframes(const ObservedFrame& view) const;
  std::vector<KeyframePlace> places_of(const std::vector<KeyframeId>& keyframes);
  void hand_out(KeyframeId keyframe, const Frame& frame, const Removal& removal);
  std::optional<SE3> labelled_from(KeyframeId keyframe);
  void follow_correction();
  void follow_world(const TrackedFrame& frame);
  std::map<WorldId, std::size_t> frames_by_world() const;
  std::set<WorldId> known_worlds() const;
  bool is_usable(const Frame& frame);
  Removal find_movables(const Frame& frame, const cv::Mat& grey);
  std::shared_ptr<const ObservedFrame> extract(const Frame& frame, const cv::Mat& grey, const cv::Mat& mask,
                                               FrameResult& result);
  void cull_contradicted(const TrackedFrame& frame, const Frame& images, const Removal& removal);
  int count_hidden(const TrackedFrame& frame, const cv::Mat& mask) const;
  void record(const TrackedFrame& frame, std::size_t index);
  void note_times(double removal, double extract, double total);
  bool removes() const;

  Camera camera_;
  Options options_;
  Mode mode_;
  SegmentationWorker segmentation_;
  DynamicRemoval removal_;
  OrbExtractor extractor_;
  MapMutex map_mutex_;
  Map map_;
  Tracker tracker_;
  KeyframePolicy keyframe_policy_;
  LocalMapper mapper_;
  std::optional<PlaceIndex> places_;
  std::optional<LoopCloser> loop_closer_;
  std::vector<Record> records_;
  std::map<TrackingState, std::size_t> frames_by_state_;
  std::map<std::string, std::size_t> rejected_;
  std::optional<double> last_timestamp_;
  int last_inliers_ = 0;
  StageTimes times_;
  // Where the camera was taken to be in the world as it was by then.
  std::optional<SE3> last_T_camera_world_;
  std::size_t followed_corrections_ = 0;
  KeyframeId last_reference_;  // of the last frame that was tracked
  // For the dense map.
  std::size_t labelled_index_ = 0;  // of the frame that the newest labels are of
  cv::Mat labels_;                  // CV_8UC1, empty: none so far
  // Last, so that their threads stop before what they use goes away.
  std::optional<DenseWorker> dense_;
  std::optional<RestorationWorker> restoration_;
  KeyframeWorker closing_;
  KeyframeWorker mapping_;
};

}  // namespace roslam
