// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/evaluate/evaluate.hpp"

#include "apps/roslam/support/commands.hpp"

namespace roslam::app {

void add_evaluate_command(CLI::App& program) {
  auto* evaluate = program.add_subcommand("evaluate", "Compare a result with the ground truth");
  evaluate->require_subcommand(1);
  add_evaluate_trajectory_command(*evaluate);
  add_evaluate_odometry_command(*evaluate);
  add_evaluate_segmentation_command(*evaluate);
  add_evaluate_removal_command(*evaluate);
  add_evaluate_restoration_command(*evaluate);
  add_evaluate_map_command(*evaluate);
}

}  // namespace roslam::app
