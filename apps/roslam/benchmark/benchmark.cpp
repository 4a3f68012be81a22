// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/benchmark.hpp"

#include "apps/roslam/support/commands.hpp"

namespace roslam::app {

void add_benchmark_command(CLI::App& program, const std::string& version) {
  auto* benchmark =
      program.add_subcommand("benchmark", "Measure accuracy, time and memory on whole sequences");
  benchmark->require_subcommand(1);
  add_benchmark_static_command(*benchmark, version);
  add_benchmark_dynamic_command(*benchmark, version);
  add_benchmark_restoration_command(*benchmark, version);
  add_benchmark_map_command(*benchmark, version);
  add_benchmark_robustness_command(*benchmark, version);
}

}  // namespace roslam::app
