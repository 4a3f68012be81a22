// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "roslam/geometry/se3.hpp"

namespace roslam {

struct StampedPose {
  double timestamp = 0.0;  ///< seconds
  SE3 T_world_camera;
};

/// Poses in the order of time.
using Trajectory = std::vector<StampedPose>;

/// A time in seconds as files and file names hold it: six decimals. Times of the same text are the same
/// moment.
std::string time_text(double timestamp);

/// The pose at a time, interpolated between the poses before and after it; nothing outside the trajectory and
/// where those two are more than max_gap seconds apart.
std::optional<StampedPose> pose_at(const Trajectory& trajectory, double time, double max_gap);

/// What read_trajectory found.
struct TrajectoryFile {
  Trajectory trajectory;    ///< sorted by time; quaternions normalised
  std::size_t skipped = 0;  ///< lines left out: NaN, quaternion far from unit length, repeated time
};

/// Reads a TUM trajectory: lines of "timestamp tx ty tz qx qy qz qw", # starts a comment.
/// Throws InputError naming file and line for a missing file, a line that is not eight numbers, or no pose at
/// all.
TrajectoryFile read_trajectory(const std::filesystem::path& file);

/// Writes a TUM trajectory, one pose a line: six decimals for the time, nine for the pose, the same bytes for
/// the same poses. Throws OutputError if the file cannot be written in full.
void write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory);

}  // namespace roslam
