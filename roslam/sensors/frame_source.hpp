// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/geometry/stereo_rig.hpp"
#include "roslam/sensors/inertial_sample.hpp"

namespace roslam {

/// One RGB-D or stereo frame.
struct ROSLAM_EXPORT Frame {
  std::size_t index = 0;   ///< position in the source, counted from 0; skipped frames leave gaps
  double timestamp = 0.0;  ///< seconds, as given by the source
  std::optional<std::chrono::steady_clock::time_point> received;  ///< when it reached this computer, if known
  int segment = 0;  ///< restarts of the source's clock before this frame, as far as the source knows
  cv::Mat colour;   ///< CV_8UC3, BGR, raw (distorted)
  cv::Mat depth;    ///< CV_32FC1, metres along the optical axis, 0 = unknown; registered to colour
  cv::Mat right;    ///< CV_8UC1, grey, of the right camera of a stereo pair; empty: none
  cv::Mat labels;   ///< CV_8UC1 class of each pixel if the source knows it, else empty
  std::vector<InertialSample>
      inertial;  ///< since the frame before, in order of time; Camera::imu says how fixed
  std::optional<SE3> T_world_camera;  ///< ground truth if the source has it; never used for tracking
};

/// Source of frames, such as a recorded dataset or a simulation. Implementations skip frames they cannot
/// read, count them by reason, and throw InputError only if the source as a whole is unusable.
class ROSLAM_EXPORT FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// The next frame, or nothing at the end. Timestamps strictly increase, unless the clock restarts.
  virtual std::optional<Frame> next() = 0;

  /// Makes a next() that waits, or is about to, return nothing within 200 ms, such as when a camera has
  /// stalled. Safe from any thread.
  virtual void interrupt() {}

  /// The next frame, or nothing at the end or soon after a stop was requested.
  std::optional<Frame> next(const std::stop_token& stop) {
    const std::stop_callback on_stop(stop, [this] { interrupt(); });
    return stop.stop_requested() ? std::nullopt : next();
  }

  /// True for a camera: frames come at its own pace and are lost if nobody takes them.
  virtual bool is_live() const { return false; }

  virtual const Camera& camera() const = 0;

  /// The right camera of stereo pairs that are not rectified (RectifiedSource does it); a camera with a
  /// baseline is that of pairs that are.
  virtual std::optional<RightCamera> right() const { return std::nullopt; }

  /// Number of frames in the source, skipped ones included, if known.
  virtual std::optional<std::size_t> size() const { return std::nullopt; }

  /// Frames skipped so far, by reason in words.
  virtual std::map<std::string, std::size_t> skipped() const { return {}; }

  /// What the source found out about its data and how often, in words, such as a list that was not sorted.
  virtual std::map<std::string, std::size_t> notes() const { return {}; }

  /// Depth images and right images that could not be used so far, by reason; their frames are without.
  virtual std::map<std::string, std::size_t> skipped_depth() const { return {}; }
};

}  // namespace roslam
