// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

struct ROSLAM_EXPORT TrackerOptions {
  int min_initial_points = 80;     ///< points of known depth that the first keyframe needs
  int min_inliers = 20;            ///< landmarks that must agree on a pose
  int min_frame_matches = 15;      ///< matches that must agree on the first estimate, before the local map
  double min_agreement = 0.5;      ///< share of all matches that must agree on the first estimate
  int trusted_inliers = 60;        ///< inliers from which on the tracking quality is 1
  int scarce_inliers = 50;         ///< below that many matches, points without a landmark are used as well
  double hidden_share = 0.5;       ///< of the image; from which a pose is predicted if tracking fails, and no
                                   ///< map is started
  double max_wait_to_start = 3.0;  ///< seconds for which movable objects that fill the image keep a map from
                                   ///< being started
  double max_predicted = 1.5;      ///< seconds since the last tracked frame for which they are
  bool use_gyroscope = true;       ///< where the source has one: its rotation is one of the predictions
  int recently_lost_frames = 30;   ///< frames after which recently lost becomes lost
  int new_submap_after_lost = 30;  ///< lost frames that could start a map before a new submap is; 0: never

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// What a pose must fulfil beside its inliers to be taken for the true one. The limits of motion are those of
/// an agile drone; a vehicle that moves less is guarded better by smaller ones.
struct ROSLAM_EXPORT PlausibilityOptions {
  double min_found_share = 0.05;     ///< of the landmarks that the pose puts into view unoccluded
  double poor_found_share = 0.16;    ///< the same, where matches are off by more than max_pixel_error
  double max_pixel_error = 1.7;      ///< sigmas, as estimated so far; more are those of blurred images
  double max_position_sigma = 0.25;  ///< metres, along the least certain direction
  double max_rotation_sigma = 5.0;   ///< degrees, about the least certain axis
  double constrained_sigma = 0.05;   ///< metres; directions less certain are reported as unconstrained
  double max_speed = 20.0;           ///< m/s
  double max_acceleration = 30.0;    ///< m/s^2, change of velocity between two frames
  double max_turn_rate = 720.0;      ///< degrees/s

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct ROSLAM_EXPORT LocalMapOptions {
  int max_keyframes = 40;  ///< keyframes whose landmarks are searched for
  int neighbours = 5;      ///< covisible keyframes of the reference keyframe that are added

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct ROSLAM_EXPORT RelocaliserOptions {
  int tries = 6;         ///< keyframes verified for one frame, at most
  int candidates = 4;    ///< similar keyframes that are tried in turn, and as many of the newest
  int min_inliers = 40;  ///< landmarks that must agree on the pose

  /// Throws OptionsError naming the field.
  void validate() const;
};

struct ROSLAM_EXPORT KeyframePolicyOptions {
  bool enabled = true;         ///< false: no keyframe is created, the map is not extended
  double max_interval = 1.0;   ///< seconds after which one may be created even if the mapper is busy
  double min_interval = 0.0;   ///< minimum seconds between keyframes
  double min_overlap = 0.6;    ///< share of the reference's landmarks tracked, below which one is created
  int min_tracked_near = 100;  ///< with fewer near landmarks tracked, and min_new_near, one is created
  int min_new_near = 70;       ///< near points without a landmark that this takes
  double near = 3.0;           ///< metres; maximum depth of near points

  /// Throws OptionsError naming the field.
  void validate() const;
};

}  // namespace roslam
