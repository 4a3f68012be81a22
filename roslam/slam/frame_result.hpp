// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/dynamic_objects/dynamic_objects.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/odometry/odometry.hpp"
#include "roslam/tracking/tracking_state.hpp"

namespace roslam {

/// Why a frame was not used.
enum class RejectReason {
  kNone,               ///< it was used
  kNoColour,           ///< no colour image
  kColourType,         ///< colour image is not 8-bit BGR
  kColourSize,         ///< colour image size differs from the camera's
  kDepthType,          ///< depth image is not 32-bit float
  kDepthSize,          ///< depth image size differs from the colour image's
  kRightImage,         ///< right image of a stereo pair is not 8-bit grey of the colour image's size
  kMask,               ///< the mask given with the frame is not 8-bit or not of its size
  kTimeNotFinite,      ///< the timestamp is not a number
  kTimeNotIncreasing,  ///< the timestamp is not later than that of the last frame that was used
  kNoMapToLocaliseIn   ///< keyframes.enabled is false and the map is empty
};

/// In words, for messages and reports.
ROSLAM_EXPORT std::string_view describe(RejectReason reason);

/// Why a frame that was used has no pose.
enum class NoPose {
  kNone,           ///< it has one
  kNoMap,          ///< there is no map yet, and the frame cannot begin one
  kNotRecognised,  ///< no keyframe of the map shows what it shows
  kFewLandmarks,   ///< too few landmarks agree with the pose that was estimated
  kUncertain,      ///< what is in view does not constrain the pose
  kPoorFit,        ///< the matches are off by much, as in a blurred image
  kImplausible,    ///< the camera would have moved faster than it can, or other than its gyroscope shows
};

/// In words, for messages and reports.
ROSLAM_EXPORT std::string_view describe(NoPose reason);

struct TrackedFrame;

/// Why a tracked frame has no pose.
NoPose reason_of(const TrackedFrame& frame);

/// What became of a frame.
struct ROSLAM_EXPORT FrameResult {
  std::size_t index = 0;                        ///< of the frame in its source
  double timestamp = 0.0;                       ///< seconds
  RejectReason rejected = RejectReason::kNone;  ///< if not kNone, nothing below but state is set
  TrackingState state = TrackingState::kInitialising;
  std::optional<SE3>
      T_world_camera;  ///< as estimated now; later corrections of the map are in Slam::trajectory()
  Matrix6d covariance = Matrix6d::Zero();  ///< of T_world_camera: (position m, rotation vector rad) in the
                                           ///< world frame, against the origin of the submap
  std::vector<Eigen::Vector3d>
      unconstrained;                 ///< directions (world, unit length) along which what is in view
                                     ///< hardly constrains the position, as along a bare corridor
  NoPose no_pose = NoPose::kNone;    ///< why there is no pose
  std::optional<Odometry> odometry;  ///< continuous pose and velocity of the body, for a controller
  SubmapId submap;                   ///< that the pose is in; submaps that overlap are merged later
  int inliers = 0;                   ///< landmarks that support the pose
  double quality = 0.0;              ///< tracking quality, 0 (predicted or unknown) to 1
  bool is_keyframe = false;
  std::size_t withdrawn = 0;          ///< poses of earlier frames that this one contradicts
  double withdrawn_after = 0.0;       ///< seconds; of the frames between that time and this one
  std::vector<std::string> warnings;  ///< what is newly doubtful about the input, with the remedy
  bool is_clock_reset = false;        ///< the source's clock was found to have restarted at this frame
  double tracking_seconds = 0.0;      ///< processor time of the tracking thread
  std::chrono::steady_clock::time_point received;  ///< when the frame reached this computer
  double latency = 0.0;                            ///< seconds from then to this result, in wall time
  DynamicObjects dynamic_objects;                  ///< what was found to move, or may move
  std::vector<cv::Point2f> points;                 ///< corners that were used, pixels of the image as taken
  std::vector<cv::Point2f> removed_points;  ///< corners on dynamic objects; never mapped, and not used but
                                            ///< for the pose where they show no motion

  bool is_used() const { return rejected == RejectReason::kNone; }
};

}  // namespace roslam
