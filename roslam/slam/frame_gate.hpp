// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>

#include "roslam/geometry/camera.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/slam/frame_result.hpp"

namespace roslam {

/// Decides which frames can be used, by the type and size of their images and by their time. Timestamps have
/// to increase; but a camera that is plugged in again starts its clock anew, and one frame may come with a
/// time far in the future. A step back by more than a second, or ten frames in a row that are not later, are
/// therefore taken for a reset of the clock, after which times increase again.
class FrameGate {
 public:
  struct Verdict {
    RejectReason reason = RejectReason::kNone;
    bool is_clock_reset = false;
  };

  explicit FrameGate(const Camera& camera) : size_(camera.width, camera.height) {}

  /// mask: empty or CV_8UC1 of the frame's size.
  Verdict check(const Frame& frame, const cv::Mat& mask);

 private:
  RejectReason check_images(const Frame& frame, const cv::Mat& mask) const;

  cv::Size size_;
  std::optional<double> last_timestamp_;  // of the last frame that was used
  int segment_ = 0;                       // of that frame
  int not_increasing_ = 0;                // frames in a row
};

}  // namespace roslam
