// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/roslam/benchmark/benchmark_run.hpp"
#include "recording/output_folder.hpp"

namespace roslam::app {

/// Command line arguments shared by the benchmarks.
struct BenchmarkArguments {
  std::vector<std::string> sequences{"simulated:street"};
  std::string camera;  ///< of folders given without one
  std::string out;
  int runs = 3;  ///< of each sequence
  bool json = false;
  bool quiet = false;
  bool overwrite = false;  ///< replace files in the folder that no benchmark wrote
  BenchmarkSettings settings;
};

/// --sequences, --camera, --out, --runs, --real-time, --config, --frames, --seed, --traffic, --overwrite,
/// --quiet, --json.
void add_benchmark_options(CLI::App& command, BenchmarkArguments& arguments);

/// The folder of --out, for this benchmark alone while it runs. Throws as OutputFolder does.
recording::OutputFolder benchmark_folder(const BenchmarkArguments& arguments);

/// Header of a benchmark's report.
struct BenchmarkHeader {
  std::string version;    ///< of the program
  std::string processor;  ///< model name
  unsigned cores = 0;
  int runs = 0;  ///< of each sequence, as asked for
  bool is_interrupted = false;
  BenchmarkSettings settings;
};

/// The header of a benchmark on this machine.
BenchmarkHeader header_of(const BenchmarkArguments& arguments, const std::string& version);

/// All runs of one sequence under the same settings.
struct BenchmarkedSequence {
  BenchmarkSequence sequence;
  std::vector<BenchmarkRun> runs;
  std::optional<bool> repeats;  ///< all complete runs gave the same trajectory; empty with fewer than two
  std::string figure;  ///< file relative to the benchmark's folder; empty if there was nothing to draw

  std::vector<const BenchmarkRun*> complete_runs() const;
};

/// Runs a sequence arguments.runs times, or until a stop is requested. name: of the runs' folders and in
/// progress messages. Throws OutputError.
BenchmarkedSequence measure(const BenchmarkSequence& sequence, const BenchmarkSettings& settings,
                            const std::string& name, const BenchmarkArguments& arguments,
                            const std::stop_token& stop);

/// Throws InputError naming the first failed run of a sequence, if one failed.
void throw_if_any_failed(const BenchmarkedSequence& sequence);

}  // namespace roslam::app
