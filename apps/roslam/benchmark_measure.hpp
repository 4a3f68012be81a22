// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/roslam/benchmark_run.hpp"

namespace roslam::app {

/// What the benchmarks take in common from the command line.
struct BenchmarkArguments {
  std::vector<std::string> sequences{"simulated:street"};
  std::string camera;  ///< of the folders that name none
  std::string out;
  int runs = 3;  ///< of each sequence
  bool json = false;
  bool quiet = false;
  BenchmarkSettings settings;
};

/// --sequences, --camera, --out, --runs, --real-time, --config, --frames, --seed, --traffic, --quiet, --json.
void add_benchmark_options(CLI::App& command, BenchmarkArguments& arguments);

/// What heads the report of a benchmark.
struct BenchmarkHeader {
  std::string version;    ///< of the program
  std::string processor;  ///< its model
  unsigned cores = 0;
  int runs = 0;  ///< of each sequence, as asked for
  bool is_interrupted = false;
  BenchmarkSettings settings;
};

/// The header of a benchmark that begins on this machine.
BenchmarkHeader header_of(const BenchmarkArguments& arguments, const std::string& version);

/// All runs of one sequence under the same settings.
struct BenchmarkedSequence {
  BenchmarkSequence sequence;
  std::vector<BenchmarkRun> runs;
  std::optional<bool> repeats;  ///< all complete runs gave the same bytes; empty with fewer than two of them
  std::string figure;  ///< file relative to the benchmark's folder; empty if there was nothing to draw

  std::vector<const BenchmarkRun*> complete_runs() const;
};

/// Runs a sequence as often as asked for, until a stop is. name: of the runs' folders, and in what is
/// told of their progress. Throws OutputError.
BenchmarkedSequence measure(const BenchmarkSequence& sequence, const BenchmarkSettings& settings,
                            const std::string& name, const BenchmarkArguments& arguments,
                            const std::stop_token& stop);

/// Throws InputError naming the first run of a sequence that failed, if one did.
void throw_if_any_failed(const BenchmarkedSequence& sequence);

}  // namespace roslam::app
