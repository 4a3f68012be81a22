// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/tracking/pose_check.hpp"
#include "roslam/tracking/tracking_state.hpp"

namespace roslam {

/// Poses that turned out to be wrong.
struct Withdrawal {
  double after = 0.0;                 ///< seconds: of frames since, without the one that contradicts them
  std::vector<KeyframeId> keyframes;  ///< made from them
  KeyframeId confirmed;               ///< reference of the last frame whose pose stays
};

/// How the camera moved since an earlier tracked frame, by the map as it is now.
struct TrackedMotion {
  double since = 0.0;  ///< seconds, time of that frame
  SE3 T_camera_since;  ///< maps coordinates in its camera frame to this frame's
};

/// The tracking result of a frame.
struct TrackedFrame {
  TrackingState state = TrackingState::kInitialising;
  double timestamp = 0.0;  ///< seconds
  std::shared_ptr<const ObservedFrame> view;
  std::optional<SE3> T_camera_world;                   ///< empty unless state is kTracking or kPredicted
  std::vector<LandmarkId> landmarks;                   ///< landmark each point shows, or none; inliers only
  double pixel_error_scale = 0.0;                      ///< as OptimisedPose
  int inliers = 0;                                     ///< landmarks that agree with the pose
  int visible = 0;                                     ///< landmarks that the pose puts into view unoccluded
  Matrix6d measurement_covariance = Matrix6d::Zero();  ///< of the pose in the local map, as OptimisedPose
  Matrix6d covariance = Matrix6d::Zero();  ///< of the pose in its submap, likewise; see PoseCovariance
  double quality = 0.0;  ///< 0 (predicted or unknown) to 1 (trusted_inliers or more inliers)
  int hidden = 0;        ///< landmarks of the reference that removed objects hide
  std::optional<TrackedMotion>
      motion;  ///< since the tracked frame before in the same submap; also of a poor fit
  PoseDoubt doubt = PoseDoubt::kNone;    ///< why the pose that was estimated last is not given out
  std::optional<Withdrawal> withdrawal;  ///< if this frame contradicts earlier ones
  KeyframeId reference;                  ///< shares most landmarks; none for the first frame of a submap
};

}  // namespace roslam
