// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/roslam/truth_benchmark.hpp"
#include "roslam/evaluation/restoration_error.hpp"

namespace roslam::app {

/// How one way of filling holes did on a sequence.
struct RestorationResult {
  std::string method;                      ///< a value of --method of `roslam restore`
  RestorationError all;                    ///< of all that was restored
  std::optional<RestorationError> behind;  ///< of what an actor really hid; nothing if that is not known
  double milliseconds = 0.0;  ///< processor time, median of the frames with holes; NaN if there were none
};

/// What a sequence came to.
struct RestoredSequence {
  BenchmarkSequence sequence;
  std::vector<RestorationResult> results;  ///< one a method, fewer if interrupted
  std::string failure;                     ///< why there are none; empty if there are
  std::string figure;  ///< file relative to the benchmark's folder; empty if there is none
};

struct RestorationBenchmarkSettings : TruthBenchmarkSettings {
  std::vector<std::string> methods{"telea", "navier-stokes", "reprojection", "gan", "both"};
  std::size_t every = 3;  ///< one frame in so many is restored
};

/// Flies through a sequence, restores it by each method and compares with the truth. A simulated flight is
/// rendered first, with its background. Throws OutputError.
RestoredSequence measure_restoration(const BenchmarkSequence& sequence,
                                     const RestorationBenchmarkSettings& settings,
                                     const std::stop_token& stop);

struct RestorationReport : BenchmarkHeader {
  std::size_t every = 1;
  std::vector<RestoredSequence> sequences;
};

// Neither holds a date.
std::string restoration_markdown(const RestorationReport& report);
std::string restoration_json(const RestorationReport& report);

}  // namespace roslam::app
