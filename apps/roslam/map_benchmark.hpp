// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "apps/roslam/truth_benchmark.hpp"
#include "roslam/evaluation/map_error.hpp"

namespace roslam::app {

/// The dense maps that are compared, as in figure 8 of the paper, and what could be had.
inline constexpr const char* kMapAsTaken = "no removal";
inline constexpr const char* kMapRemoved = "removal only";
inline constexpr const char* kMapReprojected = "and reprojection";
inline constexpr const char* kMapRestored = "all";
inline constexpr const char* kMapEmptyScene = "empty scene";

/// What a sequence came to.
struct MappedSequence {
  BenchmarkSequence sequence;
  std::vector<EvaluatedMap> maps;  ///< in that order; none if interrupted
  std::string failure;             ///< why there are none; empty if there are
  std::string figure;              ///< file relative to the benchmark's folder; empty if there is none

  // Of the run that does all.
  double fuse_milliseconds = std::numeric_limits<double>::quiet_NaN();  ///< processor time a keyframe, median
  double voxel_megabytes = std::numeric_limits<double>::quiet_NaN();
  double peak_megabytes = std::numeric_limits<double>::quiet_NaN();
  double path_length = std::numeric_limits<double>::quiet_NaN();  ///< metres

  const EvaluatedMap* find(const std::string& name) const;

  /// Share of what removal leaves open, where the empty scene has a surface, that the full map has one; NaN
  /// if there is no such thing.
  double filled_share() const;
};

struct MapBenchmarkSettings : TruthBenchmarkSettings {
  double range = 8.0;  ///< metres, as of `roslam evaluate map`
};

/// Maps a sequence as taken, with things removed, with what other views show and with all, and the same
/// flight with nothing that moves, and compares the maps with what is static. A simulated flight is rendered
/// first. Throws OutputError.
MappedSequence measure_maps(const BenchmarkSequence& sequence, const MapBenchmarkSettings& settings,
                            const std::stop_token& stop);

struct MapBenchmarkReport : BenchmarkHeader {
  double range = 0.0;  ///< metres
  std::vector<MappedSequence> sequences;
};

// Neither holds a date.
std::string map_benchmark_markdown(const MapBenchmarkReport& report);
std::string map_benchmark_json(const MapBenchmarkReport& report);

}  // namespace roslam::app
