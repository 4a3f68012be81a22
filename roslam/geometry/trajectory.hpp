// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

struct ROSLAM_EXPORT StampedPose {
  double timestamp = 0.0;  ///< seconds
  SE3 T_world_camera;
};

/// Poses in ascending order of time.
using Trajectory = std::vector<StampedPose>;

/// A time in seconds as written to files and file names: six decimals. Times of the same text are equal.
ROSLAM_EXPORT std::string time_text(double timestamp);

/// The pose at a time, interpolated (slerp, linear translation) between the poses before and after it;
/// nothing outside the trajectory and where those two are more than max_gap seconds apart.
ROSLAM_EXPORT std::optional<StampedPose> pose_at(const Trajectory& trajectory, double time, double max_gap);

/// Result of read_trajectory.
struct ROSLAM_EXPORT TrajectoryFile {
  Trajectory trajectory;  ///< sorted by time; quaternions normalised
  /// Lines ignored: NaN, quaternion far from unit length, repeated time, a last line that was cut off.
  std::size_t skipped = 0;
};

/// Reads a TUM trajectory: lines of "timestamp tx ty tz qx qy qz qw", # starts a comment.
/// Throws InputError naming file and line for a missing file, a line that is not eight numbers, or no pose at
/// all.
ROSLAM_EXPORT TrajectoryFile read_trajectory(const std::filesystem::path& file);

/// The first line of a TUM trajectory, and one of a pose.
ROSLAM_EXPORT std::string trajectory_header();
ROSLAM_EXPORT std::string trajectory_line(const StampedPose& pose);

/// Writes a TUM trajectory, one pose a line: six decimals for the time, nine for the pose. Equal poses give
/// equal bytes. Throws OutputError if the file cannot be written in full.
ROSLAM_EXPORT void write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory);

}  // namespace roslam
