// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>
#include <thread>

#include "apps/roslam/benchmark.hpp"
#include "apps/roslam/benchmark_report.hpp"
#include "apps/roslam/benchmark_sequences.hpp"
#include "apps/roslam/interrupt.hpp"
#include "apps/roslam/output.hpp"
#include "roslam/error.hpp"
#include "roslam/evaluation/trajectory_plot.hpp"
#include "roslam/write_file.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

constexpr auto kExamples = R"(Examples:
  The simulated street, nothing to download:
    roslam benchmark static --out results
  Recorded sequences, each with its camera after a colon:
    roslam benchmark static --sequences rgbd_dataset_freiburg1_rpy:tum-fr1 kitchen:7scenes --out results
  Folders of one camera; as live as the machine can:
    roslam benchmark static --sequences fr3_office fr3_cabinet --camera tum-fr3 --real-time --out results
  What `roslam simulate` wrote brings its camera.yaml; the median error for a script:
    roslam benchmark static --sequences flight --runs 1 --json --out results | jq .sequences[0].median.ate_rmse_m

A sequence is FOLDER, FOLDER:CAMERA (TUM RGB-D format) or simulated:street, :loop, :hover, :turn. CAMERA is a preset
(tum-fr1 tum-fr2 tum-fr3 7scenes d435 d455) or a YAML file. Without one, --camera counts, then a camera.yaml in the
folder. The truth is the folder's groundtruth.txt; where it is missing the accuracy is left open ("-").
DIR then holds benchmark.md, benchmark.json, a figure for each sequence and the folder of each run under runs/.
Each run is a process of its own. Ctrl-C ends the benchmark and writes what there is.
Exit code: 0 success, 1 an error in the input or a run that failed, 2 wrong usage.)";

struct Arguments {
  std::vector<std::string> sequences{"simulated:street"};
  std::string camera;
  std::string out;
  int runs = 3;
  bool real_time = false;
  bool json = false;
  bool quiet = false;
  BenchmarkSettings settings;
};

bool is_same(const Trajectory& a, const Trajectory& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const StampedPose& p, const StampedPose& q) {
    return p.timestamp == q.timestamp && p.T_world_camera.matrix() == q.T_world_camera.matrix();
  });
}

std::optional<bool> whether_runs_repeat(const BenchmarkedSequence& sequence) {
  const auto runs = sequence.complete_runs();
  if (runs.size() < 2) return std::nullopt;
  for (const auto* run : runs) {
    if (!is_same(run->trajectory, runs.front()->trajectory)) return false;
  }
  return true;
}

// Nothing if no run has a trajectory.
cv::Mat figure_of(const BenchmarkedSequence& sequence) {
  const WorldUp up = sequence.sequence.is_simulated() ? WorldUp::kZ : WorldUp::kUnknown;
  const Trajectory* truth = nullptr;
  std::vector<NamedTrajectoryError> curves;
  for (std::size_t i = 0; i < sequence.runs.size(); ++i) {
    const BenchmarkRun& run = sequence.runs[i];
    // Runs that repeat would lie on top of each other; one alone is drawn in more detail.
    if (sequence.repeats.value_or(false) && !curves.empty()) break;
    if (!run.is_complete() || !run.error) continue;
    curves.push_back({"run " + std::to_string(i + 1), *run.error});
    truth = &run.truth;
  }
  if (truth != nullptr) return plot_trajectory_errors(*truth, curves, up);
  for (const auto* run : sequence.complete_runs()) {
    if (!run->trajectory.empty()) return plot_trajectory(run->trajectory, sequence.sequence.name, up);
  }
  return {};
}

// What is known so far is written after each sequence: a power cut costs one of them, not the night.
void write_report(const BenchmarkReport& report, const fs::path& out) {
  write_file(out / "benchmark.md", benchmark_markdown(report));
  write_file(out / "benchmark.json", benchmark_json(report));
}

BenchmarkedSequence measure(const BenchmarkSequence& sequence, const Arguments& arguments,
                            const std::stop_token& stop) {
  BenchmarkedSequence result;
  result.sequence = sequence;
  for (int i = 1; i <= arguments.runs && !stop.stop_requested(); ++i) {
    if (!arguments.quiet)
      std::fprintf(stderr, "%s: run %d of %d\n", sequence.name.c_str(), i, arguments.runs);
    const std::string folder = "runs/" + sequence.name + "-" + std::to_string(i);
    result.runs.push_back(run_sequence(sequence, arguments.settings, arguments.out, folder, stop));
    if (const auto& run = result.runs.back(); !run.failure.empty() && !run.is_interrupted) {
      std::fprintf(stderr, "note: %s: run %d: %s\n", sequence.name.c_str(), i, run.failure.c_str());
    }
  }
  result.repeats = whether_runs_repeat(result);
  if (const cv::Mat figure = figure_of(result); !figure.empty()) {
    result.figure = sequence.name + ".png";
    write_png(fs::path(arguments.out) / result.figure, figure);
  }
  return result;
}

void throw_if_any_failed(const BenchmarkReport& report) {
  for (const auto& sequence : report.sequences) {
    for (const auto& run : sequence.runs) {
      if (run.is_interrupted || run.failure.empty()) continue;
      throw InputError(sequence.sequence.name + ": a run failed: " + run.failure);
    }
  }
}

void execute(const Arguments& arguments, const std::string& version) {
  const InterruptWatcher interrupt;
  const fs::path out = arguments.out;
  make_folder(out);
  BenchmarkReport report{version,
                         processor_model(),
                         std::thread::hardware_concurrency(),
                         arguments.runs,
                         false,
                         arguments.settings,
                         {}};
  // A wrong file of options would fail every run.
  if (!arguments.settings.config.empty()) read_options(arguments.settings.config);
  const auto sequences = find_sequences(arguments.sequences, arguments.camera);
  write_report(report, out);
  for (const auto& sequence : sequences) {
    if (interrupt.token().stop_requested()) break;
    report.sequences.push_back(measure(sequence, arguments, interrupt.token()));
    report.is_interrupted = interrupt.token().stop_requested();
    write_report(report, out);
  }
  if (report.is_interrupted) std::fprintf(stderr, "interrupted: the report holds what was complete\n");
  std::cout << (arguments.json ? benchmark_json(report) : benchmark_summary(report));
  if (!arguments.json) std::cout << "results: " << (out / "benchmark.md").string() << "\n";
  require_written_output();
  throw_if_any_failed(report);
}

void add_options(CLI::App& command, Arguments& arguments) {
  command
      .add_option("--sequences", arguments.sequences,
                  "What to run: FOLDER, FOLDER:CAMERA or simulated:FLIGHT")
      ->type_name("DIR")
      ->capture_default_str();
  command.add_option("--camera", arguments.camera,
                     "Camera of the folders that name none: a preset or a YAML file");
  command.add_option("--out", arguments.out, "Folder the report is written to; made if it does not exist")
      ->required()
      ->type_name("DIR");
  command.add_option("--runs", arguments.runs, "Runs of each sequence")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command.add_flag(
      "--real-time", arguments.real_time,
      "Frames at the pace of their timestamps, late ones dropped; without it stages run in lock-step");
  command.add_option("--config", arguments.settings.config, "YAML file with options for all runs");
  command.add_option("--traffic", arguments.settings.traffic, "Of simulated flights: none, light or heavy")
      ->check(CLI::IsMember({"none", "light", "heavy"}))
      ->capture_default_str();
  command.add_option("--frames", arguments.settings.frames, "Of simulated flights; 0 = all")
      ->capture_default_str();
  command.add_option("--seed", arguments.settings.seed, "Of simulated flights")->capture_default_str();
  command.add_flag("--quiet", arguments.quiet, "No progress");
  command.add_flag("--json", arguments.json, "Print the report as one JSON object");
}
}  // namespace

void add_benchmark_static_command(CLI::App& benchmark, const std::string& version) {
  auto* command =
      benchmark.add_subcommand("static", "Run sequences in which nothing moves, several times each.");
  const auto arguments = std::make_shared<Arguments>();
  add_options(*command, *arguments);
  command->footer(kExamples);
  command->callback([arguments, version] {
    if (arguments->real_time) arguments->settings.mode = Mode::kRealTime;
    execute(*arguments, version);
  });
}

}  // namespace roslam::app
