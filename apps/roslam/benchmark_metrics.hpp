// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "apps/roslam/benchmark_measure.hpp"

namespace roslam::app {

/// One number of a run: its key in JSON, its column in Markdown. NaN = unknown.
struct Metric {
  std::string key;
  std::string title;
  int decimals;
  std::function<double(const BenchmarkRun&)> of;

  /// The number as a table shows it; shares in per cent.
  std::string cell(double value) const;
};

std::vector<Metric> benchmark_metrics();

/// RMSE of the absolute trajectory error in metres; share of the sequence's frames that got a pose.
double ate_of(const BenchmarkRun& run);
double tracked_share_of(const BenchmarkRun& run);

// Over the complete runs of a sequence that know the number; NaN if none does.
double median_of(const BenchmarkedSequence& sequence,
                 const std::function<double(const BenchmarkRun&)>& value);
double stage_median(const BenchmarkedSequence& sequence, const std::string& stage,
                    double StageSummary::*value);
double stage_count(const BenchmarkedSequence& sequence, const std::string& stage);
std::set<std::string> stages_of(const BenchmarkedSequence& sequence);

/// A number in a report: counts without a point, null for what is not known.
nlohmann::ordered_json json_number(double value);

/// All that is known of a sequence: medians, stages, each run.
nlohmann::ordered_json json_of(const BenchmarkedSequence& sequence);

/// "deterministic" or "real-time".
const char* name_of(Mode mode);

/// The keys with which the JSON of every benchmark begins.
nlohmann::ordered_json head_json(const std::string& benchmark, const BenchmarkHeader& header);

/// A report as its file holds it. Names of files may hold any byte; one that is not UTF-8 is replaced, as it
/// shall not cost the report.
std::string text_of(const nlohmann::ordered_json& report);

}  // namespace roslam::app
