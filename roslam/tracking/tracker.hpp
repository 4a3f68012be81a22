// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "roslam/estimation/measurement_model.hpp"
#include "roslam/estimation/pose_optimiser.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/map.hpp"
#include "roslam/matching/projection_matcher.hpp"
#include "roslam/tracking/local_map.hpp"
#include "roslam/tracking/relocaliser.hpp"
#include "roslam/tracking/tracking_options.hpp"
#include "roslam/tracking/tracking_state.hpp"

namespace roslam {

/// What is known of a frame before it is tracked.
struct FrameHint {
  std::optional<SE3> T_camera_world;  ///< a better initial pose than predicted_pose(), if any
  double hidden_share = 0.0;          ///< of the image, hidden by dynamic objects
  bool may_start = true;  ///< false where movable objects fill the image, on which no map must start

  /// Keyframes similar to the frame, best first; called only to relocalise. May be empty.
  std::function<std::vector<KeyframeId>()> similar_keyframes = {};
};

/// The tracking result of a frame.
struct TrackedFrame {
  TrackingState state = TrackingState::kInitialising;
  double timestamp = 0.0;  ///< seconds
  std::shared_ptr<const ObservedFrame> view;
  std::optional<SE3> T_camera_world;  ///< empty unless state is kTracking or kPredicted
  std::vector<LandmarkId> landmarks;  ///< landmark each point shows, or none; inliers only
  int inliers = 0;                    ///< landmarks that agree with the pose
  double quality = 0.0;               ///< 0 (predicted or unknown) to 1 (trusted_inliers or more inliers)
  int hidden = 0;                     ///< landmarks of the reference that removed objects hide
  KeyframeId reference;               ///< shares most landmarks; none for the first frame of a submap
};

/// Estimates the pose of each frame against the map: prediction by the motion model, matching with the last
/// frame, then with the local map; relocalisation when lost, and a new submap if that fails for long. Of the
/// map it changes only Landmark::times_visible and times_found. Not thread safe; the caller holds the mutex.
class Tracker {
 public:
  struct Settings {
    TrackerOptions tracker;
    MatcherOptions matcher;
    PoseOptimiserOptions pose;
    LocalMapOptions local_map;
    GeometricVerifierOptions geometric_verifier;
    RelocaliserOptions relocaliser;
    MeasurementNoise noise;
  };

  Tracker(const Camera& camera, Map& map, const Settings& settings);

  /// view: the features of the frame; timestamp: seconds, ascending.
  TrackedFrame track(std::shared_ptr<const ObservedFrame> view, double timestamp, const FrameHint& hint = {});

  /// T_camera_world at that time (seconds) by the motion model; nothing while lost.
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

  /// Seconds the last call spent in each step, for the report.
  struct Times {
    double match_frame = 0.0;
    double match_map = 0.0;
    double optimise = 0.0;
    double relocalise = 0.0;
  };
  const Times& times() const { return times_; }

 private:
  bool can_start(const TrackedFrame& frame, const FrameHint& hint);
  TrackedFrame initialise(TrackedFrame frame);
  bool follow(TrackedFrame& frame, const std::optional<SE3>& T_camera_world);
  bool match_last_frame(TrackedFrame& frame, const SE3& predicted, float radius_factor);
  bool match_reference(TrackedFrame& frame);
  bool refine_with_local_map(TrackedFrame& frame, KeyframeId near);
  bool predict_hidden(TrackedFrame& frame, const FrameHint& hint);
  bool relocalise(TrackedFrame& frame, const FrameHint& hint);
  bool estimate(TrackedFrame& frame, const std::vector<Eigen::Vector3d>& positions,
                const std::vector<std::uint32_t>& points, int min_inliers);
  bool first_estimate(TrackedFrame& frame, const std::vector<Eigen::Vector3d>& positions,
                      const std::vector<std::uint32_t>& points);
  void match_local_landmarks(TrackedFrame& frame);
  void count_found(const TrackedFrame& frame);
  SE3 predict_pose(double timestamp) const;
  void remember(const TrackedFrame& frame);

  Camera camera_;
  Map& map_;
  Settings settings_;
  ProjectionMatcher matcher_;
  LocalMap local_map_;
  Relocaliser relocaliser_;

  TrackingState state_ = TrackingState::kInitialising;
  TrackedFrame last_;                 // the last frame with a pose
  SE3 T_last_reference_;              // its pose in its reference keyframe, which bundle adjustment may move
  std::optional<Vector6d> velocity_;  // twist of T_current_last, per second; none: unknown
  // Points of the current frame matched with points of the last frame that have no landmark.
  std::vector<std::uint32_t> unmapped_points_;
  std::vector<Eigen::Vector3d> unmapped_positions_;  // world, metres
  std::optional<double> waits_since_;  // seconds; to start a map, for a view that movable objects do not fill
  int frames_lost_ = 0;
  int frames_unrecognised_ = 0;  // of these, frames with enough points to start a submap
  Times times_;
};

}  // namespace roslam
