// SPDX-License-Identifier: BSD-3-Clause
#include <exception>
#include <iostream>

#include "apps/roslam/commands.hpp"
#include "roslam/error.hpp"

namespace {
constexpr int kInputError = 1;
constexpr int kUsageError = 2;
}  // namespace

int main(int argc, char** argv) {
  CLI::App program("RO-SLAM: visual SLAM for drones that fly where things move.");
  program.require_subcommand(1);
  program.set_version_flag("--version", ROSLAM_VERSION);
  roslam::app::add_run_command(program, ROSLAM_VERSION);
  roslam::app::add_simulate_command(program);
  roslam::app::add_evaluate_command(program);
  roslam::app::add_benchmark_command(program, ROSLAM_VERSION);
  try {
    program.parse(argc, argv);
    return 0;
  } catch (const CLI::ParseError& error) {
    return program.exit(error) == 0 ? 0 : kUsageError;
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << "\n";
    return kInputError;
  }
}
