// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/benchmark_measure.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <thread>

#include "roslam/common/error.hpp"

namespace roslam::app {

namespace {
bool is_same(const Trajectory& a, const Trajectory& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const StampedPose& p, const StampedPose& q) {
    return p.timestamp == q.timestamp && p.T_world_camera.matrix() == q.T_world_camera.matrix();
  });
}

std::optional<bool> runs_are_identical(const BenchmarkedSequence& sequence) {
  const auto runs = sequence.complete_runs();
  if (runs.size() < 2) return std::nullopt;
  for (const auto* run : runs) {
    if (!is_same(run->trajectory, runs.front()->trajectory)) return false;
  }
  return true;
}

// "unknown" if the system does not state it.
std::string processor_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    const auto colon = line.find(':');
    if (line.starts_with("model name") && colon != std::string::npos && colon + 2 < line.size()) {
      return line.substr(colon + 2);
    }
  }
  return "unknown";
}
}  // namespace

BenchmarkHeader header_of(const BenchmarkArguments& arguments, const std::string& version) {
  return {version, processor_model(), std::thread::hardware_concurrency(), arguments.runs,
          false,   arguments.settings};
}

std::vector<const BenchmarkRun*> BenchmarkedSequence::complete_runs() const {
  std::vector<const BenchmarkRun*> complete;
  for (const auto& run : runs) {
    if (run.is_complete()) complete.push_back(&run);
  }
  return complete;
}

BenchmarkedSequence measure(const BenchmarkSequence& sequence, const BenchmarkSettings& settings,
                            const std::string& name, const BenchmarkArguments& arguments,
                            const std::stop_token& stop) {
  BenchmarkedSequence result;
  result.sequence = sequence;
  for (int i = 1; i <= arguments.runs && !stop.stop_requested(); ++i) {
    if (!arguments.quiet) std::fprintf(stderr, "%s: run %d of %d\n", name.c_str(), i, arguments.runs);
    const std::string folder = "runs/" + name + "-" + std::to_string(i);
    result.runs.push_back(run_sequence(sequence, settings, arguments.out, folder, stop));
    if (const auto& run = result.runs.back(); !run.failure.empty() && !run.is_interrupted) {
      std::fprintf(stderr, "note: %s: run %d: %s\n", name.c_str(), i, run.failure.c_str());
    }
  }
  result.repeats = runs_are_identical(result);
  return result;
}

void throw_if_any_failed(const BenchmarkedSequence& sequence) {
  for (const auto& run : sequence.runs) {
    if (run.is_interrupted || run.failure.empty()) continue;
    throw InputError(sequence.sequence.name + ": a run failed: " + run.failure);
  }
}

recording::OutputFolder benchmark_folder(const BenchmarkArguments& arguments) {
  return {arguments.out, "benchmark", {"benchmark.md", "benchmark.json", "runs"}, arguments.overwrite};
}

void add_benchmark_options(CLI::App& command, BenchmarkArguments& arguments) {
  command
      .add_option("--sequences", arguments.sequences,
                  "Sequences to run: FOLDER, FOLDER:CAMERA or simulated:FLIGHT")
      ->type_name("DIR")
      ->capture_default_str();
  command.add_option("--camera", arguments.camera,
                     "Camera of folders given without one: a preset or a YAML file");
  command.add_option("--out", arguments.out, "Folder the report is written to; made if it does not exist")
      ->required()
      ->type_name("DIR");
  command.add_option("--runs", arguments.runs, "Number of runs of each sequence")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command.add_flag_callback(
      "--real-time", [&settings = arguments.settings] { settings.mode = Mode::kRealTime; },
      "Run stages in parallel, read frames at the pace of their timestamps, drop late ones");
  command.add_option("--config", arguments.settings.config, "YAML file with options for all runs");
  command
      .add_option("--traffic", arguments.settings.traffic,
                  "Traffic of simulated flights: none, light or heavy")
      ->check(CLI::IsMember({"none", "light", "heavy"}))
      ->capture_default_str();
  command.add_option("--frames", arguments.settings.frames, "Number of frames of simulated flights; 0 = all")
      ->capture_default_str();
  command.add_option("--seed", arguments.settings.seed, "Seed of simulated flights")->capture_default_str();
  command.add_flag("--stereo", arguments.settings.stereo,
                   "Simulated flights have stereo pairs in place of depth");
  command.add_flag("--overwrite", arguments.overwrite,
                   "Replace files in the folder of --out that no benchmark wrote");
  command.add_flag("--quiet", arguments.quiet, "Print no progress");
  command.add_flag("--json", arguments.json, "Print the report as one JSON object on stdout");
}

}  // namespace roslam::app
