// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "recording/recorded_removal.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/trajectory.hpp"

namespace roslam::recording {

/// The camera of a run, by its run.json. Throws InputError naming the file that is missing or damaged.
Camera camera_of_run(const std::filesystem::path& folder);

/// A finished run read from its folder: source, camera, trajectory and removed objects.
class RecordedRun {
 public:
  /// Throws InputError naming the file that is missing or damaged.
  explicit RecordedRun(const std::filesystem::path& folder);

  /// Whether the folder has the files of a run.
  static bool recognises(const std::filesystem::path& folder);

  const std::string& source() const { return source_; }  ///< as the user named it
  /// As RunDescription::flight.
  const std::map<std::string, std::string>& flight() const { return flight_; }
  const Camera& camera() const { return camera_; }
  const RecordedRemoval& removal() const { return removal_; }
  const Trajectory& trajectory() const { return trajectory_; }
  const Trajectory& keyframes() const { return keyframes_; }

  /// Pose of the frame of that timestamp (seconds); nothing if it was not tracked.
  std::optional<SE3> pose_at(double timestamp) const;

 private:
  RecordedRemoval removal_;
  std::string source_;
  std::map<std::string, std::string> flight_;
  Camera camera_;
  Trajectory trajectory_;
  Trajectory keyframes_;
};

}  // namespace roslam::recording
