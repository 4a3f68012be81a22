// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "recording/run_contents.hpp"

namespace roslam::recording {

/// Where a frame of a run was, in the coordinate frames of REP 105.
struct FramePoses {
  std::int64_t stamp = 0;               ///< ns, of ros_stamp()
  std::optional<SE3> T_map_camera;      ///< of trajectory.txt
  std::optional<std::size_t> odometry;  ///< index in RunContents::odometry
  /// Such that T_map_odom T_odom_body T_body_camera is T_map_camera: corrected by all that the run learned
  /// later, unlike Odometry::T_map_odom. Nothing for a frame that trajectory.txt does not have.
  std::optional<SE3> T_map_odom;
  SE3 T_odom_body;
};

/// The frames with a pose in trajectory.txt or odometry.csv, in the order of time. Those without odometry
/// keep the T_map_odom of the frame before (identity at first).
std::vector<FramePoses> poses_of_frames(const RunContents& run);

}  // namespace roslam::recording
