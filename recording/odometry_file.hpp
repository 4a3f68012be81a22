// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "roslam/odometry/odometry.hpp"
#include "roslam/slam/frame_result.hpp"

namespace roslam::recording {

/// The first line of odometry.csv, and that of a frame (docs/odometry.md).
std::string odometry_header();
std::string odometry_line(const FrameResult& result);

/// Reads odometry.csv: the frames with a pose, in the order of the file, without step covariances. A last
/// line that was cut off is passed over. Throws InputError naming file and line.
std::vector<Odometry> read_odometry(const std::filesystem::path& file);

}  // namespace roslam::recording
