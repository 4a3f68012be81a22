// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/ground_truth.hpp"

#include <string>
#include <utility>

#include "roslam/common/error.hpp"

namespace roslam {

Trajectory read_ground_truth(const std::filesystem::path& file, double seconds, Counts& notes) {
  TrajectoryFile read;
  try {
    read = read_trajectory(file);
  } catch (const InputError& error) {
    ++notes["the ground truth is not used: " + std::string(error.what())];
  }
  count(notes, "line of " + file.filename().string() + " that is no pose, skipped", read.skipped);
  for (StampedPose& pose : read.trajectory) pose.timestamp *= seconds;
  return std::move(read.trajectory);
}

std::optional<SE3> true_pose_at(const Trajectory& truth, double time) {
  constexpr double kMaxGap = 0.2;  // seconds
  const auto pose = pose_at(truth, time, kMaxGap);
  return pose ? std::make_optional(pose->T_world_camera) : std::nullopt;
}

}  // namespace roslam
