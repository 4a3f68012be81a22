// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "evaluation/trajectory_error.hpp"

namespace roslam::evaluation {

/// One trajectory's row in a report.
struct EvaluatedTrajectory {
  std::string name;
  std::string file;
  std::size_t skipped_lines = 0;
  TrajectoryError error;
};

/// The trajectories of one evaluation. The runs are repetitions of the system under test, whose median is
/// reported; the others are listed for comparison and not part of the median.
struct TrajectoryReport {
  std::string truth_file;
  TrajectoryErrorOptions options;
  std::vector<EvaluatedTrajectory> runs;
  std::vector<EvaluatedTrajectory> others;
};

/// Markdown tables that also read well as plain text, one for the absolute and one for the relative errors.
std::string to_markdown(const TrajectoryReport& report);

/// One JSON object; keys end in their unit; null where there is no value.
std::string to_json(const TrajectoryReport& report);

}  // namespace roslam::evaluation
