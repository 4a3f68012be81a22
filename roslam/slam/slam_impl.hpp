// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "roslam/loop_closing/loop_closer.hpp"
#include "roslam/map/keyframe_pose_table.hpp"
#include "roslam/map/map.hpp"
#include "roslam/map/map_mutex.hpp"
#include "roslam/mapping/local_mapper.hpp"
#include "roslam/odometry/odometry_estimator.hpp"
#include "roslam/odometry/world_level.hpp"
#include "roslam/place_recognition/keyframe_database.hpp"
#include "roslam/slam/frame_gate.hpp"
#include "roslam/slam/front_end.hpp"
#include "roslam/slam/live_map.hpp"
#include "roslam/slam/slam.hpp"
#include "roslam/slam/trajectory_log.hpp"
#include "roslam/stereo/dense_stereo.hpp"
#include "roslam/tracking/keyframe_policy.hpp"
#include "roslam/tracking/tracker.hpp"
#include "roslam/workers/callback_queue.hpp"
#include "roslam/workers/dense_worker.hpp"
#include "roslam/workers/keyframe_worker.hpp"
#include "roslam/workers/load_control.hpp"
#include "roslam/workers/restoration_worker.hpp"
#include "roslam/workers/stereo_depth_worker.hpp"

namespace roslam {

inline constexpr const char* kGyroscopeContradicts =
    "the images contradict the gyroscope, which is not used; check imu.T_camera_imu and its clock";

inline constexpr const char* kTracking = "tracking";  // purpose of a lock of the map

/// The parts of the pipeline and how they are joined.
struct Slam::Impl {
  Impl(const Camera& camera, const Options& options, Mode mode, std::shared_ptr<Segmenter> segmenter,
       std::shared_ptr<const Vocabulary> vocabulary);

  ~Impl() {
    load.release();    // or threads that wait would never end
    callbacks.stop();  // what they call may use all members
  }

  FrameResult process(const Frame& frame, const cv::Mat& mask);
  FrameResult track(const Frame& frame, const cv::Mat& mask);
  void finish();
  void cancel();

  void restart_clock(double timestamp);
  std::optional<SE3> predict_pose(double timestamp);
  KeyframeId create_keyframe(TrackedFrame& tracked, std::size_t frame_index);
  std::vector<KeyframeId> similar_keyframes(const ObservedFrame& view) const;
  void cull_contradicted(const TrackedFrame& tracked, const Frame& frame, const DynamicObjects& objects);
  void withdraw(const Withdrawal& wrong, FrameResult& result);
  bool remove_withdrawn(KeyframeId keyframe);
  void map_keyframe(KeyframeId keyframe, const KeyframeWorker::ShouldStop& should_stop, StageTimes& times);
  void close_loops(KeyframeId keyframe, const KeyframeWorker::ShouldStop& should_stop, StageTimes& times);
  bool needs_poses() const { return dense || restoration; }
  void publish_poses(MapChangeKind change);
  Frame with_depth(const Frame& frame);
  void submit(KeyframeId keyframe, const Frame& frame, const DynamicObjects& objects);
  DenseInput dense_input(KeyframeId keyframe, const Frame& frame, const DynamicObjects& objects);
  void hand_on(KeyframeId keyframe, DenseInput input);
  bool level_world();
  void fill(FrameResult& result, const TrackedFrame& tracked) const;
  void check_gyroscope(FrameResult& result);
  void note_times(const FrontEndResult& observation, double total);

  Camera camera;
  Options options;
  Mode mode;
  FrameGate gate;
  LoadControl load;
  FrontEnd front_end;
  std::optional<DenseStereo> dense_stereo;  // of a stereo camera
  MapMutex map_mutex;
  Map map;
  KeyframePoseTable poses;
  Tracker tracker;
  OdometryEstimator odometry;
  WorldLevel level;
  KeyframePolicy keyframe_policy;
  LocalMapper mapper;
  std::optional<KeyframeDatabase> keyframe_database;
  std::optional<LoopCloser> loop_closer;
  TrajectoryLog log;
  LiveMap live;
  OnFrame on_frame;
  OnMapChanged on_map_changed;
  StageTimes times;
  bool warned_of_gyroscope = false;
  std::size_t corrections_seen = 0;             // of the map, by level
  std::map<std::string, std::string> backends;  // what runs each network
  StageTimes latency;                           // wall time
  CallbackQueue callbacks;
  // Last, so that their threads stop before the members they use are destroyed.
  std::optional<DenseWorker> dense;
  std::optional<RestorationWorker> restoration;
  std::optional<StereoDepthWorker> stereo_depth;  // of keyframes
  KeyframeWorker closing;
  KeyframeWorker mapping;
};

}  // namespace roslam
