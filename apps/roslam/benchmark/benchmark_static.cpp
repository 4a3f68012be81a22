// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

#include "apps/roslam/benchmark/benchmark.hpp"
#include "apps/roslam/benchmark/benchmark_report.hpp"
#include "apps/roslam/benchmark/benchmark_sequences.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "evaluation/trajectory_plot.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
namespace fs = std::filesystem;

constexpr auto kExamples = R"(Examples:
  The simulated street, nothing to download:
    roslam benchmark static --out results
  Recorded sequences, each with its camera after a colon:
    roslam benchmark static --sequences rgbd_dataset_freiburg1_rpy:tum-fr1 kitchen:7scenes --out results
  Folders of one camera, in real time:
    roslam benchmark static --sequences fr3_office fr3_cabinet --camera tum-fr3 --real-time --out results
  A folder of `roslam simulate`, with its camera.yaml; the median error for a script:
    roslam benchmark static --sequences flight --runs 1 --json --out results | jq .sequences[0].median.ate_rmse_m

A sequence is FOLDER, FOLDER:CAMERA (TUM RGB-D) or simulated:street, :loop, :hover, :turn, :corridor. CAMERA is a preset
(tum-fr1 tum-fr2 tum-fr3 7scenes d435 d455) or a YAML file; without it --camera is used, else camera.yaml in
the folder. The ground truth is the folder's groundtruth.txt; without it no accuracy is given ("-").
Writes to the folder DIR of --out: benchmark.md, benchmark.json, a figure of each sequence, and the folder of
each run to runs/. Each run is a process of its own, without a dense map and with --dynamic none.
Ctrl-C ends the benchmark and writes the results so far.
Exit code: 0 success, 1 an error in the input or a run that failed, 2 wrong usage.)";

// Nothing if no run has a trajectory.
cv::Mat figure_of(const BenchmarkedSequence& sequence) {
  const WorldUp up = sequence.sequence.is_simulated() ? WorldUp::kZ : WorldUp::kUnknown;
  const Trajectory* truth = nullptr;
  std::vector<NamedTrajectoryError> curves;
  for (std::size_t i = 0; i < sequence.runs.size(); ++i) {
    const BenchmarkRun& run = sequence.runs[i];
    // Identical runs would be drawn on top of each other; a single one is drawn in more detail.
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

// Written after each sequence, so that a power cut costs one sequence and not the whole benchmark.
void write_report(const BenchmarkReport& report, const fs::path& out) {
  write_file(out / "benchmark.md", benchmark_markdown(report));
  write_file(out / "benchmark.json", benchmark_json(report));
}

void execute(const BenchmarkArguments& arguments, const std::string& version) {
  const InterruptWatcher interrupt;
  const fs::path out = arguments.out;
  const auto folder = benchmark_folder(arguments);
  BenchmarkReport report{header_of(arguments, version), {}};
  // A wrong options file would fail every run.
  if (!arguments.settings.config.empty()) read_options(arguments.settings.config);
  const auto sequences = find_sequences(arguments.sequences, arguments.camera);
  write_report(report, out);
  for (const auto& sequence : sequences) {
    if (interrupt.token().stop_requested()) break;
    auto result = measure(sequence, arguments.settings, sequence.name, arguments, interrupt.token());
    if (const cv::Mat figure = figure_of(result); !figure.empty()) {
      result.figure = sequence.name + ".png";
      write_png(out / result.figure, figure);
    }
    report.sequences.push_back(std::move(result));
    report.is_interrupted = interrupt.token().stop_requested();
    write_report(report, out);
  }
  if (report.is_interrupted) std::fprintf(stderr, "interrupted: the report holds the complete runs\n");
  std::cout << (arguments.json ? benchmark_json(report) : benchmark_summary(report));
  if (!arguments.json) std::cout << "results: " << (out / "benchmark.md").string() << "\n";
  require_written_output();
  for (const auto& sequence : report.sequences) throw_if_any_failed(sequence);
}

}  // namespace

void add_benchmark_static_command(CLI::App& benchmark, const std::string& version) {
  auto* command = benchmark.add_subcommand(
      "static", "Run static sequences several times each; report accuracy, time and memory");
  const auto arguments = std::make_shared<BenchmarkArguments>();
  add_benchmark_options(*command, *arguments);
  command->footer(kExamples);
  command->callback([arguments, version] { execute(*arguments, version); });
}

}  // namespace roslam::app
