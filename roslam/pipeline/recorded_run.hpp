// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/pipeline/recorded_removal.hpp"

namespace roslam {

/// What `roslam run` flew, where the camera was and what was removed, read back from the folder it wrote.
class RecordedRun {
 public:
  /// Throws InputError naming the file that is missing or damaged.
  explicit RecordedRun(const std::filesystem::path& folder);

  /// True if the folder looks like one of a run.
  static bool recognises(const std::filesystem::path& folder);

  const std::string& source() const { return source_; }                         ///< as the user named it
  const std::map<std::string, std::string>& flight() const { return flight_; }  ///< as RunDescription::flight
  const Camera& camera() const { return camera_; }
  const RecordedRemoval& removal() const { return removal_; }
  const Trajectory& trajectory() const { return trajectory_; }
  const Trajectory& keyframes() const { return keyframes_; }

  /// Pose of the frame of that time; nothing if it was not tracked.
  std::optional<SE3> pose_at(double timestamp) const;

 private:
  RecordedRemoval removal_;
  std::string source_;
  std::map<std::string, std::string> flight_;
  Camera camera_;
  Trajectory trajectory_;
  Trajectory keyframes_;
};

}  // namespace roslam
