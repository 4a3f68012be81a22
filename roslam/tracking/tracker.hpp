// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "roslam/estimation/measurement_model.hpp"
#include "roslam/estimation/pose_optimiser.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/map.hpp"
#include "roslam/matching/projection_matcher.hpp"
#include "roslam/tracking/initial_pose.hpp"
#include "roslam/tracking/local_map.hpp"
#include "roslam/tracking/motion_model.hpp"
#include "roslam/tracking/pose_check.hpp"
#include "roslam/tracking/pose_covariance.hpp"
#include "roslam/tracking/relocaliser.hpp"
#include "roslam/tracking/tentative_poses.hpp"
#include "roslam/tracking/tracked_frame.hpp"
#include "roslam/tracking/tracking_options.hpp"

namespace roslam {

/// What is known of a frame before it is tracked.
struct FrameHint {
  std::optional<SE3> T_camera_world;  ///< a prediction beside predicted_pose(), as by optical flow
  double hidden_share = 0.0;          ///< of the image, hidden by dynamic objects
  cv::Mat depth = {};                 ///< CV_32FC1 metres, 0 = unknown; tells what is occluded; may be empty
  std::vector<std::uint8_t> rested = {};  ///< as RestingPoints: where few points are static
  bool may_start = true;  ///< false where movable objects fill the image, on which no map must start
  SE3 T_camera_start =
      forward_camera().inverse();  ///< T_camera_world that a submap begins with at this frame

  /// Keyframes similar to the frame, best first; called only to relocalise. May be empty.
  std::function<std::vector<KeyframeId>()> similar_keyframes = {};
};

/// Estimates the pose of each frame against the map: initial poses by matches with the last frame around
/// several predictions and with the reference keyframe, of which the best supported is refined with the local
/// map; relocalisation when lost, and a new submap if that fails for long. Of the
/// map it changes only Landmark::times_visible and times_found. Not thread safe; the caller holds the mutex.
class Tracker {
 public:
  struct Settings {
    TrackerOptions tracker;
    PlausibilityOptions plausible;
    MatcherOptions matcher;
    PoseOptimiserOptions pose;
    LocalMapOptions local_map;
    GeometricVerifierOptions geometric_verifier;
    RelocaliserOptions relocaliser;
    MeasurementNoise noise;
    double resting_weight = 0.0;  ///< as DynamicObjectOptions
  };

  Tracker(const Camera& camera, Map& map, const Settings& settings);

  /// Inertial samples up to the time of the next frame (seconds), in the order of time; without Camera::imu
  /// they are ignored. To be called before predicted_pose() and track().
  void add_inertial(std::span<const InertialSample> samples, double frame_time) {
    motion_.add_inertial(samples, frame_time);
  }

  /// view: the features of the frame; timestamp: seconds, ascending.
  TrackedFrame track(std::shared_ptr<const ObservedFrame> view, double timestamp, const FrameHint& hint = {});

  /// T_camera_world at that time (seconds) by the gyroscope and the motion model; nothing while lost.
  std::optional<SE3> predicted_pose(double timestamp) const;

  /// To be called when the last frame became this keyframe, with the landmarks created for it.
  void keyframe_created(KeyframeId keyframe);

  /// To be called when the source's clock was reset to that time (seconds).
  void restart_clock(double timestamp);

  /// T_camera_world of the last tracked frame, following later corrections of the map; nothing before the
  /// first.
  std::optional<SE3> last_pose() const;

  TrackingState state() const { return state_; }

  /// The landmarks of the local map of the last frame; some may have been removed since.
  const std::vector<LandmarkId>& local_landmarks() const { return local_map_.landmarks(); }

  /// How many poses were not taken for the true ones so far, by reason.
  const std::map<PoseDoubt, std::size_t>& doubts() const { return doubts_; }

  /// The gyroscope and what is known of its bias; nothing if the camera has none.
  const std::optional<Gyroscope>& gyroscope() const { return motion_.gyroscope(); }

  /// Seconds the last call spent in each step, for the report.
  struct Times {
    double match_frame = 0.0;
    double match_map = 0.0;
    double optimise = 0.0;
    double relocalise = 0.0;
  };
  const Times& times() const { return times_; }

 private:
  static void drop_pose(TrackedFrame& frame);
  void withhold_poor_fit(TrackedFrame& frame);
  bool can_start(const TrackedFrame& frame, const FrameHint& hint);
  TrackedFrame initialise(TrackedFrame frame, const SE3& T_camera_world);
  bool follow(TrackedFrame& frame, const FrameHint& hint);
  std::vector<SE3> predictions(double timestamp, const std::optional<SE3>& by_flow) const;
  bool accept_best(TrackedFrame& frame, std::vector<PoseCandidate> candidates, const FrameHint& hint);
  RestingPoints resting_points(const TrackedFrame& frame, const std::vector<std::uint32_t>& used);
  void refine_with_local_map(TrackedFrame& frame, PoseCandidate candidate, KeyframeId near,
                             const cv::Mat& depth);
  PoseDoubt doubt_of(const TrackedFrame& frame, int min_inliers) const;
  bool is_accepted(TrackedFrame& frame, int min_inliers);
  bool predict_hidden(TrackedFrame& frame, const FrameHint& hint);
  bool relocalise(TrackedFrame& frame, const FrameHint& hint);
  void match_local_landmarks(TrackedFrame& frame, const cv::Mat& depth);
  bool is_occluded(const Prediction& predicted, const cv::Mat& depth) const;
  void count_found(const TrackedFrame& frame);
  const TrackedState* confirmed_here(KeyframeId keyframe, double timestamp) const;
  bool is_poor_fit(const TrackedFrame& frame) const;
  int of_tentative(const std::vector<LandmarkId>& landmarks) const;
  bool is_strong(const TrackedFrame& frame) const;
  void reconsider(TrackedFrame& frame);
  bool contradicts_last(const TrackedFrame& frame);
  SE3 measured_again(const TrackedState& state) const;
  void remember(TrackedFrame& frame);
  void note_positions();

  Camera camera_;
  Map& map_;
  Settings settings_;
  ProjectionMatcher matcher_;
  InitialPoseEstimator initial_pose_;
  LocalMap local_map_;
  Relocaliser relocaliser_;
  PoseCovariance covariance_;
  MotionModel motion_;

  TrackingState state_ = TrackingState::kInitialising;
  TrackedState last_;  // the last frame with a pose
  TentativePoses tentative_;
  std::vector<std::uint8_t> rested_;   // as FrameHint
  bool is_contradiction_ = false;      // the pose that was accepted last contradicts tentative ones
  std::optional<double> waits_since_;  // seconds; to start a map, for a view that movable objects do not fill
  std::optional<double> last_fit_;     // seconds, of the last frame that was not a poor fit
  int frames_lost_ = 0;
  int frames_unrecognised_ = 0;  // of these, frames with enough points to start a submap
  std::map<PoseDoubt, std::size_t> doubts_;
  Times times_;
};

}  // namespace roslam
