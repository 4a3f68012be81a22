// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/map/map.hpp"
#include "roslam/tracking/tracker.hpp"
#include "roslam/tracking/tracking_options.hpp"

namespace roslam {

/// Decides which frames become keyframes.
class KeyframePolicy {
 public:
  /// Throws OptionsError.
  explicit KeyframePolicy(const KeyframePolicyOptions& options);

  /// True if the frame should become a keyframe. mapper_idle: the mapper has no keyframe to process.
  bool needs_keyframe(const TrackedFrame& frame, const Map& map, bool mapper_idle) const;

  /// To be called when the frame became a keyframe.
  void keyframe_created(const TrackedFrame& frame) { last_timestamp_ = frame.timestamp; }

  /// To be called when the source's clock was reset to that time (seconds).
  void restart_clock(double timestamp) { last_timestamp_ = timestamp; }

 private:
  KeyframePolicyOptions options_;
  double last_timestamp_ = 0.0;
};

/// Landmarks of the frame's reference keyframe that project into the mask (CV_8UC1 of the image as taken,
/// nonzero on dynamic objects; may be empty), for TrackedFrame::hidden. 0 where the frame has no pose.
int count_hidden_landmarks(const Map& map, const TrackedFrame& frame, const Camera& camera,
                           const cv::Mat& mask);

/// Landmarks of the frame's reference keyframe in view of the frame.
struct LandmarksInView {
  int all = 0;
  int on_objects = 0;  ///< in the mask, at the depth measured there
};

/// Which landmarks turn out to be on dynamic objects rather than behind them. mask: as above; depth:
/// CV_32FC1, metres. Nothing where the frame has no pose or nothing is masked.
LandmarksInView landmarks_on_objects(const Map& map, const TrackedFrame& frame, const Camera& camera,
                                     const cv::Mat& mask, const cv::Mat& depth);

}  // namespace roslam
