// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "apps/roslam/benchmark/benchmark_measure.hpp"

namespace roslam::app {

/// One number of a run: its key in JSON, its column in Markdown. NaN = unknown.
struct Metric {
  std::string key;
  std::string title;
  int decimals;
  std::function<double(const BenchmarkRun&)> of;

  /// The number as shown in a table; shares in per cent.
  std::string cell(double value) const;
};

std::vector<Metric> benchmark_metrics();

/// RMSE of the absolute trajectory error in metres; share of the sequence's frames that got a pose.
double ate_of(const BenchmarkRun& run);
double tracked_share_of(const BenchmarkRun& run);

// Median over the complete runs of a sequence where the number is known; NaN if there are none.
double median_of(const BenchmarkedSequence& sequence,
                 const std::function<double(const BenchmarkRun&)>& value);
double stage_median(const BenchmarkedSequence& sequence, const std::string& stage,
                    double StageSummary::*value);
double stage_count(const BenchmarkedSequence& sequence, const std::string& stage);
std::set<std::string> stages_of(const BenchmarkedSequence& sequence);

/// A number in a report: integers without a decimal point, null for NaN.
nlohmann::ordered_json json_number(double value);

/// All results of a sequence: medians, stages, each run.
nlohmann::ordered_json json_of(const BenchmarkedSequence& sequence);

/// "deterministic" or "real-time".
const char* name_of(Mode mode);

/// The leading keys of the JSON of every benchmark.
nlohmann::ordered_json head_json(const std::string& benchmark, const BenchmarkHeader& header);

/// A report as text. Bytes of file names that are not valid UTF-8 are replaced rather than refused.
std::string text_of(const nlohmann::ordered_json& report);

}  // namespace roslam::app
