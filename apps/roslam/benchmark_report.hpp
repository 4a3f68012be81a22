// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "apps/roslam/benchmark_run.hpp"

namespace roslam::app {

struct BenchmarkedSequence {
  BenchmarkSequence sequence;
  std::vector<BenchmarkRun> runs;
  std::optional<bool> repeats;  ///< all complete runs gave the same bytes; empty with fewer than two of them
  std::string figure;  ///< file relative to the benchmark's folder; empty if there was nothing to draw

  std::vector<const BenchmarkRun*> complete_runs() const;
};

struct BenchmarkReport {
  std::string version;    ///< of the program
  std::string processor;  ///< its model
  unsigned cores = 0;
  int runs = 0;  ///< of each sequence, as asked for
  bool is_interrupted = false;
  BenchmarkSettings settings;
  std::vector<BenchmarkedSequence> sequences;
};

/// The model of the processor this runs on, "unknown" where the system does not tell.
std::string processor_model();

// Neither holds a date: two reports differ where results do. Medians are over complete runs.
std::string benchmark_markdown(const BenchmarkReport& report);
std::string benchmark_json(const BenchmarkReport& report);

/// Only the table with a line for each sequence.
std::string benchmark_summary(const BenchmarkReport& report);

}  // namespace roslam::app
