// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/benchmark_run.hpp"

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "apps/roslam/support/child_process.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
namespace fs = std::filesystem;

std::vector<std::string> run_arguments(const BenchmarkSequence& sequence, const BenchmarkSettings& settings,
                                       const fs::path& out) {
  std::vector<std::string> arguments{"run",     sequence.source, "--out",     out.string(),
                                     "--quiet", "--no-dense",    "--dynamic", settings.dynamic};
  const auto add = [&](const std::string& option, const std::string& value) {
    arguments.push_back(option);
    arguments.push_back(value);
  };
  arguments.emplace_back(settings.mode == Mode::kRealTime ? "--real-time" : "--deterministic");
  if (!settings.config.empty()) add("--config", settings.config);
  if (settings.degrade != "none") add("--degrade", settings.degrade);
  if (!sequence.is_simulated()) {
    if (!sequence.camera.empty()) add("--camera", sequence.camera);
    return arguments;
  }
  add("--traffic", settings.traffic);
  add("--frames", std::to_string(settings.frames));
  add("--seed", std::to_string(settings.seed));
  if (settings.stereo) arguments.emplace_back("--stereo");
  return arguments;
}

// A negative time in run.json means that there was no pose.
double time_or_nan(double seconds) {
  return seconds < 0.0 ? std::numeric_limits<double>::quiet_NaN() : seconds;
}

void read_report(const fs::path& file, BenchmarkRun& run) {
  const auto report = nlohmann::json::parse(std::ifstream(file));
  const auto& frames = report.at("frames");
  run.is_interrupted = report.at("interrupted").get<bool>();
  run.frames = frames.at("in_source").get<double>();
  run.tracked = frames.at("tracked").get<double>();
  run.dropped = frames.at("dropped").get<double>();
  run.keyframes = report.at("keyframes").get<double>();
  run.landmarks = report.at("landmarks").get<double>();
  run.frames_per_second = report.at("frames_per_second").get<double>();
  run.start_up_seconds = time_or_nan(report.at("start_up_seconds").get<double>());
  run.peak_memory_megabytes = report.at("peak_memory_megabytes").get<double>();
  for (const auto& [stage, times] : report.at("processor_milliseconds").items()) {
    run.stages[stage] = {times.at("count").get<std::size_t>(), times.at("mean").get<double>(),
                         times.at("median").get<double>(), times.at("p95").get<double>(),
                         times.at("max").get<double>()};
  }
}

void compare_with_truth(const BenchmarkSequence& sequence, const fs::path& folder, BenchmarkRun& run) {
  run.truth = sequence.truth;
  try {
    // The run writes the truth that its source has.
    if (run.truth.empty() && fs::exists(folder / "groundtruth.txt"))
      run.truth = read_trajectory(folder / "groundtruth.txt").trajectory;
    if (run.tracked == 0.0) {
      run.no_error_reason = "no frame was tracked";
      return;
    }
    run.trajectory = read_trajectory(folder / "trajectory.txt").trajectory;
    if (run.truth.empty()) {
      run.no_error_reason = "the sequence has no groundtruth.txt";
      return;
    }
    run.error = evaluate_trajectory(run.truth, run.trajectory);
  } catch (const InputError& error) {
    run.no_error_reason = error.what();
  }
}

std::string why_it_failed(const ChildResult& result) {
  if (result.signal != 0) return "ended by signal " + std::to_string(result.signal);
  constexpr std::string_view kPrefix = "error: ";
  if (result.last_line.empty()) return "ended with exit code " + std::to_string(result.code);
  return result.last_line.starts_with(kPrefix) ? result.last_line.substr(kPrefix.size()) : result.last_line;
}
}  // namespace

BenchmarkRun run_sequence(const BenchmarkSequence& sequence, const BenchmarkSettings& settings,
                          const fs::path& out, const std::string& folder, const std::stop_token& stop) {
  BenchmarkRun run;
  run.folder = folder;
  make_folder(out / folder);
  const auto result =
      run_this_program(run_arguments(sequence, settings, out / folder), out / folder / "stderr.txt", stop);
  if (result.code != 0) {
    run.is_interrupted = stop.stop_requested();
    run.failure = why_it_failed(result);
    return run;
  }
  try {
    read_report(out / folder / "run.json", run);
  } catch (const nlohmann::json::exception& problem) {
    run.failure = std::string("its run.json is not as expected: ") + problem.what();
    return run;
  }
  compare_with_truth(sequence, out / folder, run);
  return run;
}

}  // namespace roslam::app
