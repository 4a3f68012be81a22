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

/// What a run was made from, by its run.json.
struct RunSource {
  std::string name;                           ///< as the user named it
  std::map<std::string, std::string> flight;  ///< as RunDescription::flight
  Camera camera;
  bool is_whole = true;  ///< the run came to the end of the source
};

/// Also of a run that was killed. Throws InputError naming the file that is missing or damaged.
RunSource source_of_run(const std::filesystem::path& folder);

/// The camera of a run, by its run.json. Throws InputError naming the file that is missing or damaged.
Camera camera_of_run(const std::filesystem::path& folder);

/// A finished run read from its folder: source, camera, trajectory and removed objects.
class RecordedRun {
 public:
  /// Throws InputError naming the file that is missing or damaged.
  explicit RecordedRun(const std::filesystem::path& folder);

  /// Whether the folder has the files of a run.
  static bool recognises(const std::filesystem::path& folder);

  const RunSource& source() const { return source_; }
  const Camera& camera() const { return source_.camera; }
  const RecordedRemoval& removal() const { return removal_; }
  const Trajectory& trajectory() const { return trajectory_; }
  const Trajectory& keyframes() const { return keyframes_; }

  /// Pose of the frame of that timestamp (seconds); nothing if it was not tracked.
  std::optional<SE3> pose_at(double timestamp) const;

 private:
  RecordedRemoval removal_;
  Trajectory trajectory_;
  Trajectory keyframes_;
  RunSource source_;
};

}  // namespace roslam::recording
