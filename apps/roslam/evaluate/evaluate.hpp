// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>

namespace roslam::app {

// Each adds one subcommand to `roslam evaluate`.
void add_evaluate_trajectory_command(CLI::App& evaluate);
void add_evaluate_odometry_command(CLI::App& evaluate);
void add_evaluate_segmentation_command(CLI::App& evaluate);
void add_evaluate_removal_command(CLI::App& evaluate);
void add_evaluate_restoration_command(CLI::App& evaluate);
void add_evaluate_map_command(CLI::App& evaluate);

}  // namespace roslam::app
