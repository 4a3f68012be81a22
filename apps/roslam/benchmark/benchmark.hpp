// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace roslam::app {

// Each adds one subcommand to `roslam benchmark`.
void add_benchmark_static_command(CLI::App& benchmark, const std::string& version);
void add_benchmark_dynamic_command(CLI::App& benchmark, const std::string& version);
void add_benchmark_restoration_command(CLI::App& benchmark, const std::string& version);
void add_benchmark_robustness_command(CLI::App& benchmark, const std::string& version);
void add_benchmark_map_command(CLI::App& benchmark, const std::string& version);

}  // namespace roslam::app
