// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <csignal>
#include <exception>
#include <iostream>
#include <opencv2/core/utility.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <string>

#include "apps/roslam/support/commands.hpp"
#include "roslam/common/out_of_memory.hpp"
#include "roslam/version.hpp"

namespace {
constexpr int kInputError = 1;
constexpr int kUsageError = 2;

// An error is one line on stderr, for scripts; messages of other libraries may have several.
std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}
}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGXFSZ, SIG_IGN);  // a file beyond the limit of its size is an error of the call that writes it
  // Pipeline stages have threads of their own and measure the processor time of those: OpenCV's thread pool
  // would compete with them, and its work would be missing from the measured times.
  cv::setNumThreads(1);
  // OpenCV prints what it then throws, which is reported once, below.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  CLI::App program("RO-SLAM: RGB-D SLAM for drones in dynamic environments.");
  program.require_subcommand(1);
  program.set_version_flag("--version", roslam::kVersion);
  roslam::app::add_run_command(program, roslam::kVersion);
  roslam::app::add_simulate_command(program);
  roslam::app::add_compose_command(program);
  roslam::app::add_restore_command(program, roslam::kVersion);
  roslam::app::add_render_command(program);
  roslam::app::add_segment_command(program);
  roslam::app::add_evaluate_command(program);
  roslam::app::add_map_command(program);
  roslam::app::add_vocabulary_command(program);
  roslam::app::add_benchmark_command(program, roslam::kVersion);
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
