// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// One moment of the camera.
struct Frame {
  std::size_t index = 0;   ///< position in the source, counted from 0; skipped frames leave gaps
  double timestamp = 0.0;  ///< seconds, as the source gives it
  cv::Mat colour;          ///< CV_8UC3, BGR, as taken (distorted)
  cv::Mat depth;           ///< CV_32FC1, metres along the optical axis, 0 = unknown; registered to colour
  cv::Mat labels;          ///< CV_8UC1 class of each pixel where the source knows it, else empty
  std::optional<SE3> T_world_camera;  ///< true pose where the source knows it; never used for tracking
};

/// Where frames come from: a recorded dataset, a simulation, later a live camera. Implementations skip frames
/// they cannot read, count them by reason, and throw InputError only when the source as a whole is unusable.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// The next frame, or nothing at the end. Timestamps strictly increase.
  virtual std::optional<Frame> next() = 0;

  virtual const Camera& camera() const = 0;

  /// Number of frames in the source, those that will be skipped included, where it is known.
  virtual std::optional<std::size_t> size() const { return std::nullopt; }

  /// Frames skipped so far, by reason in words.
  virtual std::map<std::string, std::size_t> skipped() const { return {}; }

  /// Depth images that could not be used so far, by reason in words; their frames came without depth.
  virtual std::map<std::string, std::size_t> skipped_depth() const { return {}; }
};

}  // namespace roslam
