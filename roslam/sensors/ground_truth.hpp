// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

#include "roslam/geometry/trajectory.hpp"
#include "roslam/sensors/counts.hpp"

namespace roslam {

/// Reads the true poses that belong to a recording (TUM format). seconds: the unit of their times. A file
/// that cannot be read gives none and a note, as a recording can be used without it; so are lines that are
/// no pose counted in notes.
Trajectory read_ground_truth(const std::filesystem::path& file, double seconds, Counts& notes);

/// The true pose at a time, interpolated between poses at most 0.2 s apart.
std::optional<SE3> true_pose_at(const Trajectory& truth, double time);

}  // namespace roslam
