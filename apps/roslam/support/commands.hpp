// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <stdexcept>
#include <string>

namespace roslam::app {

/// Results are written, but are not all that --strict asks for: exit code 3.
class IncompleteRun : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A check has a negative result, which is printed: exit code 3 as well.
class FailedCheck : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Each adds one subcommand. Its callback does the work and throws roslam::Error on bad input.
void add_run_command(CLI::App& program, const std::string& version);
/// `camera list`; camera: the command it belongs to.
void add_camera_list_command(CLI::App& camera);
void add_record_command(CLI::App& program);
void add_info_command(CLI::App& program);
void add_simulate_command(CLI::App& program);
void add_compose_command(CLI::App& program);
void add_restore_command(CLI::App& program, const std::string& version);
void add_render_command(CLI::App& program);
void add_segment_command(CLI::App& program);
void add_evaluate_command(CLI::App& program);
void add_map_command(CLI::App& program);
void add_export_command(CLI::App& program);
void add_camera_command(CLI::App& program);
void add_telemetry_command(CLI::App& program);
void add_view_command(CLI::App& program);
void add_vocabulary_command(CLI::App& program);
void add_benchmark_command(CLI::App& program, const std::string& version);

}  // namespace roslam::app
