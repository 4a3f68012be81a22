// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "evaluation/camera_check/edge_alignment.hpp"
#include "evaluation/camera_check/frame_run.hpp"

namespace roslam::evaluation {

/// Two colour images of a run, the points that were tracked from one to the other, and the depth around the
/// time of the first.
struct TrackedPair {
  std::size_t run = 0;
  std::vector<Eigen::Vector2d> from, to;  ///< raw pixels
  /// Depth images of a quarter of the size (CV_32FC1, metres), from kMostLag frames before to as many after.
  std::array<cv::Mat, 2 * EdgeAlignment::kMostLag + 1> depths;
  cv::Size size;                      ///< of the colour images
  std::optional<SE3> T_to_from = {};  ///< ground truth

  /// Depth at the point i of the first image under an alignment; nothing where it is unknown or steep.
  std::optional<double> depth(std::size_t i, const Alignment& alignment) const;
};

enum class TrackDirection { kForward, kBackward };

/// Tracks corners (Shi and Tomasi) by optical flow (Lucas and Kanade) from frame to frame of a run, as far as
/// half of them are found. Nothing without enough texture. The run has at least 2 kMostLag + 2 frames.
std::optional<TrackedPair> track_run(const FrameRun& run, std::size_t run_index, TrackDirection direction);

}  // namespace roslam::evaluation
