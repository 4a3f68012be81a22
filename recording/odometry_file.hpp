// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "roslam/odometry/odometry.hpp"
#include "roslam/slam/frame_result.hpp"

namespace roslam::recording {

/// The first line of odometry.csv, and that of a frame (docs/odometry.md).
std::string odometry_header();
std::string odometry_line(const FrameResult& result);

/// A line of odometry.csv.
struct OdometryRow {
  double timestamp = 0.0;  ///< seconds
  TrackingState state = TrackingState::kInitialising;
  NoPose no_pose = NoPose::kNone;
  std::optional<Odometry> odometry;  ///< without its step covariance
};

/// Reads odometry.csv: all frames, in the order of the file. A last line that was cut off is passed over.
/// Throws InputError naming file and line.
std::vector<OdometryRow> read_odometry_rows(const std::filesystem::path& file);

/// Reads odometry.csv: the frames with a pose, in the order of the file, without step covariances. A last
/// line that was cut off is passed over. Throws InputError naming file and line.
std::vector<Odometry> read_odometry(const std::filesystem::path& file);

}  // namespace roslam::recording
