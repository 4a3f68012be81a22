// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/pose_optimiser.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/map.hpp"
#include "roslam/tracking/local_map.hpp"
#include "roslam/tracking/projection_matcher.hpp"
#include "roslam/tracking/relocaliser.hpp"

namespace roslam {

enum class TrackingState {
  kInitialising,  ///< no map yet: waiting for a picture with enough points of known depth
  kTracking,      ///< the pose is known
  kPredicted,     ///< what moves hides the scene; the pose is what the motion until then suggests
  kRecentlyLost,  ///< the pose was known a moment ago; searching near the last keyframes
  kLost           ///< searching among all keyframes
};

std::string_view name_of(TrackingState state);

struct TrackerOptions {
  int min_initial_points = 80;  ///< points of known depth the first keyframe needs
  int min_inliers = 20;         ///< landmarks a pose must rest on
  int min_frame_matches = 15;   ///< matches with the last frame that a first estimate must rest on
  double min_agreement = 0.5;   ///< share of those matches that must agree on it, else matching was by chance
  int trusted_inliers = 60;     ///< landmarks from which on a pose is trusted fully
  int scarce_inliers = 50;      ///< landmarks below which the last frame's points help with the pose, too
  double hidden_share =
      0.5;  ///< of the picture that must be hidden for a pose to be predicted where tracking fails
  double max_predicted = 1.5;     ///< seconds for which it may be
  int recently_lost_frames = 30;  ///< frames after which recently lost becomes lost
  int new_world_frames = 30;  ///< frames with points enough for a start that are not recognised, after which
                              ///< a new world is begun; 0: never

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// What is known of a frame before it is tracked.
struct FrameHint {
  std::optional<SE3> T_camera_world;  ///< a better guess than predicted_pose(), if there is one
  double hidden_share = 0.0;          ///< of the picture, hidden by what moves

  /// Keyframes that look like the frame, best first; asked for only if the tracker is lost. May be empty.
  std::function<std::vector<KeyframeId>()> similar_keyframes = {};
};

/// What tracking found out about a frame.
struct TrackedFrame {
  TrackingState state = TrackingState::kInitialising;
  double timestamp = 0.0;  ///< seconds
  std::shared_ptr<const ObservedFrame> view;
  std::optional<SE3> T_camera_world;  ///< empty unless state is kTracking or kPredicted
  std::vector<LandmarkId> landmarks;  ///< landmark each point shows, or none; inliers only
  int inliers = 0;                    ///< landmarks the pose rests on
  double trust = 0.0;    ///< 0 (predicted or unknown) to 1 (on trusted_inliers or more landmarks)
  int hidden = 0;        ///< landmarks of the reference that lie behind what was removed
  KeyframeId reference;  ///< keyframe that shares most landmarks; none where a world begins
};

/// Estimates the pose of each frame against the map: predicts it from the motion so far, matches with the
/// last frame, then with the local map; recovers against the keyframes when lost, and begins a new world
/// where that fails for long. Changes nothing in the map but the landmarks' counters of predicted and found.
class Tracker {
 public:
  struct Settings {
    TrackerOptions tracker;
    MatcherOptions matcher;
    PoseOptimiserOptions pose;
    LocalMapOptions local_map;
    PlaceCheckOptions place_check;
    RelocaliserOptions relocaliser;
    MeasurementNoise noise;
  };

  Tracker(const Camera& camera, Map& map, const Settings& settings);

  /// Frames must come in the order of time.
  TrackedFrame track(std::shared_ptr<const ObservedFrame> view, double timestamp, const FrameHint& hint = {});

  /// T_camera_world at that time as the motion so far suggests it; nothing unless the pose was known a moment
  /// ago.
  std::optional<SE3> predicted_pose(double timestamp) const;

  /// Tells that the frame tracked last became this keyframe (its landmarks are taken over).
  void promoted(KeyframeId keyframe);

  /// T_camera_world of the last frame whose pose was known, in the world as the map has it now; nothing
  /// before the first such frame.
  std::optional<SE3> last_pose() const;

  TrackingState state() const { return state_; }

  /// The landmarks around the last frame, some of which may be gone by now.
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
  bool can_start(const TrackedFrame& frame) const;
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
  void count_predictions(const TrackedFrame& frame);
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
  // Points of the frame in work that show what the last frame saw and the map does not know.
  std::vector<std::uint32_t> passing_points_;
  std::vector<Eigen::Vector3d> passing_positions_;  // world, metres
  int frames_lost_ = 0;
  int frames_unrecognised_ = 0;  // of these, frames that a world could have begun with
  Times times_;
};

}  // namespace roslam
