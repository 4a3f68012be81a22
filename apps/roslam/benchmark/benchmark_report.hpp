// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "apps/roslam/benchmark/benchmark_measure.hpp"

namespace roslam::app {

struct BenchmarkReport : BenchmarkHeader {
  std::vector<BenchmarkedSequence> sequences;
};

// Without a date, so that equal results give equal reports. Medians are over complete runs.
std::string benchmark_markdown(const BenchmarkReport& report);
std::string benchmark_json(const BenchmarkReport& report);

/// Only the table with one row per sequence.
std::string benchmark_summary(const BenchmarkReport& report);

}  // namespace roslam::app
