// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/frame_result.hpp"

#include "roslam/tracking/tracked_frame.hpp"

namespace roslam {

std::string_view describe(RejectReason reason) {
  switch (reason) {
    case RejectReason::kNone:
      return "used";
    case RejectReason::kNoColour:
      return "no colour image";
    case RejectReason::kColourType:
      return "colour image is not 8-bit BGR";
    case RejectReason::kColourSize:
      return "colour image size differs from the camera's";
    case RejectReason::kDepthType:
      return "depth image is not 32-bit float";
    case RejectReason::kDepthSize:
      return "depth image size differs from the colour image's";
    case RejectReason::kRightImage:
      return "right image is not 8-bit grey of the left image's size";
    case RejectReason::kMask:
      return "mask is not 8-bit of the colour image's size";
    case RejectReason::kTimeNotFinite:
      return "time is not a number";
    case RejectReason::kTimeNotIncreasing:
      return "time does not increase";
    case RejectReason::kNoMapToLocaliseIn:
      return "keyframes.enabled is false and there is no map to localise in";
  }
  return "unknown";
}

std::string_view describe(NoPose reason) {
  switch (reason) {
    case NoPose::kNone:
      return "pose known";
    case NoPose::kNoMap:
      return "no map yet: too few points of known depth or movable objects fill the image";
    case NoPose::kNotRecognised:
      return "the map does not show what the image shows";
    case NoPose::kFewLandmarks:
      return "too few landmarks agree";
    case NoPose::kUncertain:
      return "what is in view does not constrain the pose";
    case NoPose::kPoorFit:
      return "matches are off by much as in a blurred image";
    case NoPose::kImplausible:
      return "the motion is not plausible";
  }
  return "unknown";
}

NoPose reason_of(const TrackedFrame& frame) {
  if (frame.T_camera_world) return NoPose::kNone;
  if (frame.state == TrackingState::kInitialising) return NoPose::kNoMap;
  switch (frame.doubt) {
    case PoseDoubt::kNone:
      return NoPose::kNotRecognised;
    case PoseDoubt::kFewInliers:
    case PoseDoubt::kFewFound:
      return NoPose::kFewLandmarks;
    case PoseDoubt::kUncertain:
      return NoPose::kUncertain;
    case PoseDoubt::kPoorFit:
      return NoPose::kPoorFit;
    case PoseDoubt::kSpeed:
    case PoseDoubt::kAcceleration:
    case PoseDoubt::kTurnRate:
    case PoseDoubt::kGyroscope:
      return NoPose::kImplausible;
  }
  return NoPose::kNotRecognised;
}

}  // namespace roslam
