// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <stop_token>
#include <string>

#include "apps/roslam/benchmark/benchmark_sequences.hpp"
#include "evaluation/trajectory_error.hpp"
#include "roslam/common/stage_times.hpp"
#include "roslam/options/options.hpp"

namespace roslam::app {

/// Settings shared by all runs of a benchmark.
struct BenchmarkSettings {
  Mode mode = Mode::kDeterministic;
  std::string dynamic = "none";  ///< detection of dynamic objects: a name of dynamic_modes()
  std::string config;            ///< file with options; empty = the defaults
  std::string traffic = "none";  ///< of simulated flights
  std::size_t frames = 300;      ///< of simulated flights; 0 = all
  std::uint32_t seed = 1;        ///< of simulated flights
  bool stereo = false;           ///< simulated flights have stereo pairs in place of depth
  std::string degrade = "none";  ///< of the images: a name of simulation::degradation_names()
};

/// Results of one run of a sequence. Unknown numbers are NaN.
struct BenchmarkRun {
  std::string folder;   ///< of its files, relative to the benchmark's folder
  std::string failure;  ///< why there is no result; empty if there is one
  bool is_interrupted = false;
  double frames = 0.0;   ///< of the sequence
  double tracked = 0.0;  ///< frames with a pose
  double dropped = 0.0;
  double keyframes = 0.0;
  double landmarks = 0.0;
  double frames_per_second = 0.0;
  double start_up_seconds = 0.0;  ///< from the start of the process to the first pose
  double peak_memory_megabytes = 0.0;
  std::map<std::string, StageSummary> stages;  ///< processor time
  std::optional<evaluation::TrajectoryError>
      error;                    ///< empty without truth, or if the two cannot be compared
  std::string no_error_reason;  ///< why they cannot be compared
  Trajectory trajectory;
  Trajectory truth;

  bool is_complete() const { return failure.empty() && !is_interrupted; }
};

/// Runs a sequence once in a process of its own, so that memory and start-up time are those of the run, and
/// reads what it wrote to out/folder. A failure of the run is stored in the result; OutputError is thrown
/// only if the benchmark's folder cannot be written to.
BenchmarkRun run_sequence(const BenchmarkSequence& sequence, const BenchmarkSettings& settings,
                          const std::filesystem::path& out, const std::string& folder,
                          const std::stop_token& stop);

}  // namespace roslam::app
