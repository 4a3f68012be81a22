// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "apps/roslam/benchmark_measure.hpp"

namespace roslam::app {

struct BenchmarkReport : BenchmarkHeader {
  std::vector<BenchmarkedSequence> sequences;
};

// Neither holds a date: two reports differ where results do. Medians are over complete runs.
std::string benchmark_markdown(const BenchmarkReport& report);
std::string benchmark_json(const BenchmarkReport& report);

/// Only the table with a line for each sequence.
std::string benchmark_summary(const BenchmarkReport& report);

}  // namespace roslam::app
