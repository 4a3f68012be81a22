// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/slam/frame_gate.hpp"

#include <cmath>

namespace roslam {

namespace {
constexpr double kStepBack = 1.0;  // seconds, more than frames that overtake each other on the way differ by
constexpr int kInARow = 10;        // frames
}  // namespace

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
  if (!frame.right.empty() && (frame.right.type() != CV_8UC1 || frame.right.size() != size_))
    return RejectReason::kRightImage;
  if (!mask.empty() && (mask.type() != CV_8UC1 || mask.size() != size_)) return RejectReason::kMask;
  return RejectReason::kNone;
}

}  // namespace roslam
