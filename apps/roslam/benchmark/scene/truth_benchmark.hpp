// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/roslam/benchmark/benchmark_measure.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam::app {

/// Arguments of benchmarks that compare with the background of dynamic objects.
struct TruthBenchmarkSettings {
  BenchmarkArguments common;
  std::string truth;  ///< folder of the same frames without dynamic objects; empty: beside the sequence
  std::optional<double> depth_units;  ///< per metre, of their depth images
};

/// --sequences, --camera, --out, --truth, --truth-depth-units, --traffic, --frames, --seed, --quiet, --json.
/// sequences_help: the help text of --sequences.
void add_truth_benchmark_options(CLI::App& command, TruthBenchmarkSettings& settings,
                                 const std::string& sequences_help);

/// The sequences, checked to be usable. Throws as find_sequences() does, and CLI::ValidationError.
std::vector<BenchmarkSequence> sequences_of(const TruthBenchmarkSettings& settings);

/// Measures the sequences and writes the report after each, until a stop is requested. Throws OutputError,
/// and InputError naming a sequence that failed.
template <typename Report, typename Measure, typename ToText>
void run_truth_benchmark(const BenchmarkArguments& common, const std::vector<BenchmarkSequence>& sequences,
                         const InterruptWatcher& interrupt, Report report, const Measure& measure_one,
                         const ToText& to_markdown, const ToText& to_json) {
  const std::filesystem::path out = common.out;
  const auto write = [&] {
    report.is_interrupted = interrupt.token().stop_requested();
    write_file(out / "benchmark.md", to_markdown(report));
    write_file(out / "benchmark.json", to_json(report));
  };
  write();
  for (const auto& sequence : sequences) {
    if (interrupt.token().stop_requested()) break;
    report.sequences.push_back(measure_one(sequence));
    write();
  }
  std::cout << (common.json ? to_json(report) : to_markdown(report));
  if (!common.json) std::cout << "\nresults: " << (out / "benchmark.md").string() << "\n";
  require_written_output();
  for (const auto& sequence : report.sequences)
    if (!sequence.failure.empty()) throw InputError(sequence.sequence.name + ": " + sequence.failure);
}

}  // namespace roslam::app
