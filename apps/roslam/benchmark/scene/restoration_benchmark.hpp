// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/roslam/benchmark/scene/truth_benchmark.hpp"
#include "evaluation/restoration_error.hpp"

namespace roslam::app {

/// Results of one restoration method on a sequence.
struct RestorationResult {
  std::string method;                                  ///< a value of --method of `roslam restore`
  evaluation::RestorationError all;                    ///< of all restored pixels
  std::optional<evaluation::RestorationError> behind;  ///< of those an actor hid; nothing if not known
  double milliseconds = 0.0;  ///< processor time per frame with holes, median; NaN if there were none
};

/// Results of a sequence.
struct RestoredSequence {
  BenchmarkSequence sequence;
  std::vector<RestorationResult> results;  ///< one per method, fewer if interrupted
  std::string failure;                     ///< why there are none; empty if there are
  std::string figure;  ///< file relative to the benchmark's folder; empty if there is none
};

struct RestorationBenchmarkSettings : TruthBenchmarkSettings {
  std::vector<std::string> methods{"telea", "navier-stokes", "reprojection", "gan", "both"};
  std::size_t every = 3;  ///< every so many-th frame is restored
};

/// Runs a sequence, restores it by each method and compares with the truth. A simulated flight is rendered
/// first, with its background. A failure is stored in the result, except OutputError, which is thrown.
RestoredSequence measure_restoration(const BenchmarkSequence& sequence,
                                     const RestorationBenchmarkSettings& settings,
                                     const std::stop_token& stop);

struct RestorationReport : BenchmarkHeader {
  std::size_t every = 1;
  std::vector<RestoredSequence> sequences;
};

// Without a date, so that equal results give equal reports.
std::string restoration_markdown(const RestorationReport& report);
std::string restoration_json(const RestorationReport& report);

}  // namespace roslam::app
