// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/roslam/benchmark/scene/truth_benchmark.hpp"
#include "evaluation/map_error.hpp"

namespace roslam::app {

/// The dense maps that are compared, as in figure 8 of the paper, and the reference.
inline constexpr const char* kMapAsTaken = "no rejection";
inline constexpr const char* kMapRemoved = "rejection only";
inline constexpr const char* kMapReprojected = "with reprojection";
inline constexpr const char* kMapRestored = "all stages";
inline constexpr const char* kMapEmptyScene = "empty scene";

/// Results of a sequence.
struct MappedSequence {
  BenchmarkSequence sequence;
  std::vector<evaluation::EvaluatedMap> maps;  ///< in that order; none if interrupted
  std::string failure;                         ///< why there are none; empty if there are
  std::string figure;  ///< file relative to the benchmark's folder; empty if there is none

  // Of the run with all stages.
  double fuse_milliseconds =
      std::numeric_limits<double>::quiet_NaN();  ///< processor time per keyframe, median
  double voxel_megabytes = std::numeric_limits<double>::quiet_NaN();
  double peak_megabytes = std::numeric_limits<double>::quiet_NaN();
  double path_length = std::numeric_limits<double>::quiet_NaN();  ///< metres

  const evaluation::EvaluatedMap* find(const std::string& name) const;

  /// Of the surface of the empty scene that is missing with rejection only, the share that all stages fill;
  /// NaN if nothing is missing.
  double filled_share() const;
};

struct MapBenchmarkSettings : TruthBenchmarkSettings {
  double range = 8.0;  ///< metres, as of `roslam evaluate map`
};

/// Builds the five dense maps of a sequence and compares them with the static ground truth. A simulated
/// flight is rendered first. A failure is stored in the result, except OutputError, which is thrown.
MappedSequence measure_maps(const BenchmarkSequence& sequence, const MapBenchmarkSettings& settings,
                            const std::stop_token& stop);

struct MapBenchmarkReport : BenchmarkHeader {
  double range = 0.0;  ///< metres
  std::vector<MappedSequence> sequences;
};

// Without a date, so that equal results give equal reports.
std::string map_benchmark_markdown(const MapBenchmarkReport& report);
std::string map_benchmark_json(const MapBenchmarkReport& report);

}  // namespace roslam::app
