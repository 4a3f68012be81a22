// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

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

void execute(const BenchmarkArguments& arguments, const std::string& version) {
  const InterruptWatcher interrupt;
  const fs::path out = arguments.out;
  make_folder(out);
  BenchmarkReport report{header_of(arguments, version), {}};
  // A wrong file of options would fail every run.
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
  if (report.is_interrupted) std::fprintf(stderr, "interrupted: the report holds what was complete\n");
  std::cout << (arguments.json ? benchmark_json(report) : benchmark_summary(report));
  if (!arguments.json) std::cout << "results: " << (out / "benchmark.md").string() << "\n";
  require_written_output();
  for (const auto& sequence : report.sequences) throw_if_any_failed(sequence);
}

}  // namespace

void add_benchmark_static_command(CLI::App& benchmark, const std::string& version) {
  auto* command =
      benchmark.add_subcommand("static", "Run sequences in which nothing moves, several times each.");
  const auto arguments = std::make_shared<BenchmarkArguments>();
  add_benchmark_options(*command, *arguments);
  command->footer(kExamples);
  command->callback([arguments, version] { execute(*arguments, version); });
}

}  // namespace roslam::app
