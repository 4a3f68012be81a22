// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/frame_gate.hpp"

#include <cmath>

namespace roslam {

namespace {
constexpr double kStepBack = 1.0;  // seconds, more than frames that overtake each other on the way differ by
constexpr int kInARow = 10;        // frames
}  // namespace

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
      return "no map yet: too few points of known depth, or movable objects fill the image";
    case NoPose::kNotRecognised:
      return "the map does not show what the image shows";
    case NoPose::kFewLandmarks:
      return "too few landmarks agree";
    case NoPose::kUncertain:
      return "what is in view does not constrain the pose";
    case NoPose::kPoorFit:
      return "matches are off by much, as in a blurred image";
    case NoPose::kImplausible:
      return "the motion is not plausible";
  }
  return "unknown";
}

FrameGate::Verdict FrameGate::check(const Frame& frame, const cv::Mat& mask) {
  if (const RejectReason reason = check_images(frame, mask); reason != RejectReason::kNone) return {reason};
  if (!std::isfinite(frame.timestamp)) return {RejectReason::kTimeNotFinite};
  bool is_clock_reset = last_timestamp_ && frame.segment != segment_;
  if (!is_clock_reset && last_timestamp_ && frame.timestamp <= *last_timestamp_) {
    is_clock_reset = *last_timestamp_ - frame.timestamp > kStepBack || ++not_increasing_ >= kInARow;
    if (!is_clock_reset) return {RejectReason::kTimeNotIncreasing};
  }
  not_increasing_ = 0;
  last_timestamp_ = frame.timestamp;
  segment_ = frame.segment;
  return {RejectReason::kNone, is_clock_reset};
}

RejectReason FrameGate::check_images(const Frame& frame, const cv::Mat& mask) const {
  if (frame.colour.empty()) return RejectReason::kNoColour;
  if (frame.colour.type() != CV_8UC3) return RejectReason::kColourType;
  if (frame.colour.size() != size_) return RejectReason::kColourSize;
  if (!frame.depth.empty() && frame.depth.type() != CV_32FC1) return RejectReason::kDepthType;
  if (!frame.depth.empty() && frame.depth.size() != size_) return RejectReason::kDepthSize;
  if (!mask.empty() && (mask.type() != CV_8UC1 || mask.size() != size_)) return RejectReason::kMask;
  return RejectReason::kNone;
}

}  // namespace roslam
