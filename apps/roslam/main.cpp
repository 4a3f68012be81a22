// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>

#include <algorithm>
#include <csignal>
#include <exception>
#include <iostream>
#include <opencv2/core/utility.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <string>

#include "apps/roslam/support/backend_option.hpp"
#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/help_formatter.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/usage_error.hpp"
#include "roslam/common/out_of_memory.hpp"
#include "roslam/version.hpp"

namespace {
constexpr int kInputError = 1;
constexpr int kUsageError = 2;
constexpr int kIncomplete = 3;

// An error is one line on stderr, for scripts; messages of other libraries may have several.
std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

// Faults of files and pipes must be errors of the calls that write, not ends of the program.
void prepare_output() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  // A file that is opened while stdout or stderr is closed would take its place, and what is printed.
  for (int descriptor = 0; descriptor <= 2; ++descriptor)
    if (fcntl(descriptor, F_GETFD) < 0) open("/dev/null", O_RDWR);
}

void add_commands(CLI::App& program) {
  roslam::app::add_run_command(program, roslam::kVersion);
  roslam::app::add_record_command(program);
  roslam::app::add_info_command(program);
  roslam::app::add_simulate_command(program);
  roslam::app::add_compose_command(program);
  roslam::app::add_restore_command(program, roslam::kVersion);
  roslam::app::add_render_command(program);
  roslam::app::add_view_command(program);
  roslam::app::add_segment_command(program);
  roslam::app::add_evaluate_command(program);
  roslam::app::add_map_command(program);
  roslam::app::add_export_command(program);
  roslam::app::add_telemetry_command(program);
  roslam::app::add_camera_command(program);
  roslam::app::add_vocabulary_command(program);
  roslam::app::add_benchmark_command(program, roslam::kVersion);
}

// Parses the arguments, which executes the command. Returns the exit code.
int execute(CLI::App& program, int argc, char** argv) {
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) {
      std::cerr << "error: " << one_line(roslam::app::explain(program, error)) << "\n";
      return kUsageError;
    }
    program.exit(error);  // prints --help or --version
  }
  roslam::app::require_written_output();
  return 0;
}
}  // namespace

int main(int argc, char** argv) {
  prepare_output();
  // Pipeline stages have threads of their own and measure the processor time of those: OpenCV's thread pool
  // would compete with them, and its work would be missing from the measured times.
  cv::setNumThreads(1);
  // OpenCV prints what it then throws, which is reported once, below.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  CLI::App program("RO-SLAM: RGB-D SLAM for drones in dynamic environments.", "roslam");
  program.formatter(std::make_shared<roslam::app::HelpFormatter>(roslam::app::terminal_width()));
  program.require_subcommand(1);
  program.set_version_flag("--version", std::string(roslam::kVersion) +
                                            "\nnetworks run with: " + roslam::app::backends_in_words());
  add_commands(program);
  try {
    return execute(program, argc, argv);
  } catch (const roslam::app::IncompleteRun& error) {
    std::cerr << "error: " << one_line(error.what()) << "\n";
    return kIncomplete;
  } catch (const roslam::app::FailedCheck& error) {
    std::cerr << "error: " << one_line(error.what()) << "\n";
    return kIncomplete;
  } catch (const std::exception& error) {
    const bool is_memory = roslam::is_out_of_memory(error);
    std::cerr << "error: "
              << (is_memory ? "out of memory; close other programs or use smaller images"
                            : one_line(error.what()))
              << "\n";
    return kInputError;
  }
}
