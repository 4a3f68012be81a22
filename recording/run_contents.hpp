// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "recording/display_messages.hpp"
#include "recording/recorded_run.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/odometry/odometry.hpp"

namespace roslam::recording {

/// What a run folder holds for display. A run that was killed, or that made no dense map, has less of it.
struct RunContents {
  RunSource source;
  Trajectory trajectory;                        ///< in the frame map
  std::vector<Odometry> odometry;               ///< in the order of its file
  Trajectory truth;                             ///< in a frame of its own
  std::vector<ColouredPoint> landmarks, dense;  ///< in the frame map
  std::filesystem::path masks;     ///< folder of the masks of removed objects; empty: there are none
  std::vector<std::string> notes;  ///< what is not there or was left out, in words
};

/// Reads a run folder as far as its files are there. most_points: of each of the two maps; of more, as many,
/// evenly spread over the file, are kept. Throws InputError naming the file and the remedy if the folder is
/// not of a run, a file is damaged, or there is neither a pose nor a map.
RunContents read_run_contents(const std::filesystem::path& folder, std::size_t most_points);

/// T_map_truth, which lays the true poses over those of the run by the mean of both (align_poses). Nothing if
/// no two poses are of the same time.
std::optional<SE3> place_of_truth(const RunContents& run);

}  // namespace roslam::recording
