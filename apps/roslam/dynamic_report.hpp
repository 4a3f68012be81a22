// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/roslam/benchmark_measure.hpp"
#include "apps/roslam/dynamic_sequences.hpp"
#include "roslam/evaluation/removal_error.hpp"

namespace roslam::app {

/// What one sequence came to in each mode of removal, and its twin; both in the order of the report's modes,
/// shorter if the benchmark was interrupted.
struct DynamicResult {
  BenchmarkSequence sequence;
  bool has_twin = false;
  std::vector<BenchmarkedSequence> by_mode;
  std::vector<BenchmarkedSequence> twin_by_mode;
  /// What the first run of each mode removed; empty where the truth does not tell what moves. May be shorter.
  std::vector<std::optional<RemovalError>> removal;
  std::string figure;  ///< the trajectories; relative to the benchmark's folder, empty if there is none
};

/// The mode of removal in the settings counts for nothing here, and runs are those of each mode.
struct DynamicReport : BenchmarkHeader {
  std::vector<std::string> modes;  ///< names of removal_modes()
  std::vector<DynamicResult> results;
  std::string bars;  ///< the bar chart; relative to the benchmark's folder, empty if there is nothing to draw
};

inline constexpr double kAllTracked = 0.9995;  ///< share of the frames from which on it is all of them

/// A mode with the system that it stands for.
std::string title_of_mode(const std::string& mode);

/// Median error of the mode of that number in metres; NaN if it is not known.
double ate_in(const std::vector<BenchmarkedSequence>& results, std::size_t mode);

/// The same, NaN also where frames or runs were lost: an error over a part of them is no smaller error.
double whole_ate_in(const std::vector<BenchmarkedSequence>& results, std::size_t mode);

// Neither holds a date: two reports differ where results do. Medians are over complete runs.
std::string dynamic_markdown(const DynamicReport& report);
std::string dynamic_json(const DynamicReport& report);

/// Only the table of errors.
std::string dynamic_summary(const DynamicReport& report);

/// Errors by sequence and mode (CV_8UC3); empty if none is known.
cv::Mat dynamic_bars(const DynamicReport& report);

}  // namespace roslam::app
