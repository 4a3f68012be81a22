// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <exception>
#include <iostream>
#include <opencv2/core/utility.hpp>
#include <string>

#include "apps/roslam/commands.hpp"
#include "roslam/out_of_memory.hpp"

namespace {
constexpr int kInputError = 1;
constexpr int kUsageError = 2;

// Scripts read one line; messages of other libraries may hold several.
std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}
}  // namespace

int main(int argc, char** argv) {
  // Stages run side by side on threads of their own and are told their cost in processor time: threads within
  // OpenCV would neither help the first nor show in the second.
  cv::setNumThreads(1);
  CLI::App program("RO-SLAM: visual SLAM for drones that fly where things move.");
  program.require_subcommand(1);
  program.set_version_flag("--version", ROSLAM_VERSION);
  roslam::app::add_run_command(program, ROSLAM_VERSION);
  roslam::app::add_simulate_command(program);
  roslam::app::add_compose_command(program);
  roslam::app::add_restore_command(program, ROSLAM_VERSION);
  roslam::app::add_render_command(program);
  roslam::app::add_segment_command(program);
  roslam::app::add_evaluate_command(program);
  roslam::app::add_map_command(program);
  roslam::app::add_vocabulary_command(program);
  roslam::app::add_benchmark_command(program, ROSLAM_VERSION);
  try {
    program.parse(argc, argv);
    return 0;
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? 0 : kUsageError;
  } catch (const std::exception& error) {
    const bool is_memory = roslam::is_out_of_memory(error);
    std::cerr << "error: "
              << (is_memory ? "out of memory; close other programs or use smaller images"
                            : one_line(error.what()))
              << "\n";
    return kInputError;
  }
}
