// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/roslam/benchmark/benchmark_measure.hpp"
#include "apps/roslam/benchmark/dynamic/dynamic_sequences.hpp"
#include "evaluation/removal_error.hpp"

namespace roslam::app {

/// Results of one sequence and of its static counterpart in each mode; both in the order of the report's
/// modes, shorter if the benchmark was interrupted.
struct DynamicResult {
  BenchmarkSequence sequence;
  bool has_counterpart = false;
  std::vector<BenchmarkedSequence> by_mode;
  std::vector<BenchmarkedSequence> counterpart_by_mode;
  /// Removal of the first run of each mode; empty if the truth of the dynamic objects is not known. May be
  /// shorter.
  std::vector<std::optional<evaluation::RemovalError>> removal;
  std::string figure;  ///< the trajectories; relative to the benchmark's folder, empty if there is none
};

/// The mode in the header's settings is not used; its runs are those of each mode.
struct DynamicReport : BenchmarkHeader {
  std::vector<std::string> modes;  ///< names of dynamic_modes()
  std::vector<DynamicResult> results;
  std::string bars;  ///< the bar chart; relative to the benchmark's folder, empty if there is nothing to draw
};

inline constexpr double kAllTracked = 0.9995;  ///< smallest share that counts as all frames

/// A mode with the system of the paper that it corresponds to.
std::string title_of_mode(const std::string& mode);

/// Median ATE RMSE of the mode of that index, metres; NaN if not known.
double ate_in(const std::vector<BenchmarkedSequence>& results, std::size_t mode);

/// The same, but NaN if frames were not tracked or runs failed: an error over a part of the frames cannot be
/// compared.
double whole_ate_in(const std::vector<BenchmarkedSequence>& results, std::size_t mode);

// Without a date, so that equal results give equal reports. Medians are over complete runs.
std::string dynamic_markdown(const DynamicReport& report);
std::string dynamic_json(const DynamicReport& report);

/// Only the table of errors.
std::string dynamic_summary(const DynamicReport& report);

/// Errors by sequence and mode (CV_8UC3); empty if none is known.
cv::Mat dynamic_bars(const DynamicReport& report);

}  // namespace roslam::app
