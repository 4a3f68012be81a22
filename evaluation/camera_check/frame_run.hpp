// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <opencv2/core.hpp>
#include <optional>
#include <stop_token>
#include <vector>

#include "roslam/geometry/se3.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam::evaluation {

/// What a camera check takes of a frame.
struct CheckFrame {
  double timestamp = 0.0;                  ///< seconds
  cv::Mat grey;                            ///< CV_8UC1, raw (distorted)
  cv::Mat depth;                           ///< CV_32FC1, metres, 0 = unknown
  std::optional<SE3> T_world_camera = {};  ///< ground truth
};

/// Consecutive frames.
using FrameRun = std::vector<CheckFrame>;

struct FrameRunOptions {
  std::size_t length = 16;       ///< frames of a run; as few as 10 of a short recording
  std::size_t most_runs = 24;    ///< spread over the recording; a source of unknown length: its beginning
  std::size_t most_read = 4000;  ///< frames, which bounds the time with long recordings
};

/// Takes short runs of consecutive frames, spread over a source, one after the other, so that a single run is
/// in memory. A missing frame, an empty depth image or a restarted clock ends a run, which is left out.
class FrameRunSampler {
 public:
  /// source: must outlive it. progress: is called with the number of frames read and that of those to read.
  FrameRunSampler(FrameSource& source, const FrameRunOptions& options,
                  std::function<void(std::size_t, std::size_t)> progress);

  /// The next run, or nothing at the end or after a stop was requested.
  std::optional<FrameRun> next(const std::stop_token& stop);

  std::size_t length() const { return options_.length; }  ///< frames of a run
  std::size_t frames_read() const { return read_; }
  std::size_t frames_with_depth() const { return with_depth_; }

 private:
  FrameSource& source_;
  FrameRunOptions options_;
  std::function<void(std::size_t, std::size_t)> progress_;
  std::size_t expected_ = 0;  // frames to read
  std::size_t interval_ = 0;  // frames from the beginning of a run to that of the next
  std::size_t read_ = 0;
  std::size_t with_depth_ = 0;
  std::size_t runs_ = 0;
};

}  // namespace roslam::evaluation
