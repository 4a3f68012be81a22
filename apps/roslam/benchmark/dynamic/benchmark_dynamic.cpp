// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>

#include "apps/roslam/benchmark/benchmark.hpp"
#include "apps/roslam/benchmark/benchmark_measure.hpp"
#include "apps/roslam/benchmark/dynamic/dynamic_report.hpp"
#include "apps/roslam/evaluate/removal_evaluation.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/sources.hpp"
#include "evaluation/trajectory_plot.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"

namespace roslam::app {

using namespace evaluation;
using namespace simulation;

namespace {
namespace fs = std::filesystem;

constexpr auto kExamples = R"(Examples:
  The simulated street with and without traffic, nothing to download:
    roslam benchmark dynamic --out results
  A sequence composed with people; the recording without them is run for comparison:
    roslam compose kitchen --camera 7scenes --people people --out kitchen_people
    roslam benchmark dynamic --sequences kitchen_people --out results
  Tables 3 and 5 of the paper, beside its figures:
    scripts/get_tum --out tum
    roslam benchmark dynamic --tum tum --runs 10 --out results
  A sequence with a static counterpart recorded separately; two modes, in real time:
    roslam benchmark dynamic --sequences busy:tum-fr1 --counterparts quiet:tum-fr1 --modes none both \
        --real-time --out results

A sequence is FOLDER, FOLDER:CAMERA (TUM RGB-D) or simulated:street, :loop, :hover, :turn, :corridor. CAMERA is a preset
(tum-fr1 tum-fr2 tum-fr3 7scenes d435 d455) or a YAML file; without it --camera is used, else camera.yaml in
the folder. The ground truth is the folder's groundtruth.txt; without it no accuracy is given ("-").
The static counterpart of a sequence is the same without dynamic objects: of a simulated flight the one
without traffic, of a composed sequence the recording it was composed from, else what --counterparts names.
Writes to the folder DIR of --out: benchmark.md with tables and a bar chart, benchmark.json, a figure of each
sequence, and the folder of each run to runs/. Each run is a process of its own, without a dense map.
Ctrl-C ends the benchmark and writes the results so far.
Exit code: 0 success, 1 an error in the input or a run that failed, 2 wrong usage.)";

struct DynamicArguments {
  BenchmarkArguments common;
  std::vector<std::string> modes = dynamic_modes();
  std::vector<std::string> counterparts;
  std::string tum;
};

// One curve per mode: of its first run with an accuracy.
cv::Mat figure_of(const DynamicResult& result, const std::vector<std::string>& modes) {
  const WorldUp up = result.sequence.is_simulated() ? WorldUp::kZ : WorldUp::kUnknown;
  const Trajectory* truth = nullptr;
  std::vector<NamedTrajectoryError> curves;
  for (std::size_t i = 0; i < result.by_mode.size(); ++i) {
    for (const auto* run : result.by_mode[i].complete_runs()) {
      if (!run->error) continue;
      curves.push_back({modes[i], *run->error});
      truth = &run->truth;
      break;
    }
  }
  return truth == nullptr ? cv::Mat() : plot_trajectory_errors(*truth, curves, up);
}

// Written after each mode of a sequence, so that a power cut costs one mode and not the whole benchmark.
void write_report(DynamicReport& report, const fs::path& out) {
  if (const cv::Mat bars = dynamic_bars(report); !bars.empty()) {
    report.bars = "bars.png";
    write_png(out / report.bars, bars);
  }
  write_file(out / "benchmark.md", dynamic_markdown(report));
  write_file(out / "benchmark.json", dynamic_json(report));
}

// Nothing if the truth of the dynamic objects is not known, or nothing was to be removed.
std::optional<RemovalError> removal_of(const BenchmarkedSequence& measured, const BenchmarkSettings& settings,
                                       const BenchmarkArguments& arguments, const std::stop_token& stop) {
  const auto runs = measured.complete_runs();
  if (runs.empty() || settings.dynamic == "none") return std::nullopt;
  const BenchmarkSequence& sequence = measured.sequence;
  SourceArguments source{sequence.source, sequence.camera};
  if (sequence.is_simulated()) {
    source.traffic = settings.traffic;
    source.frames = settings.frames;
    source.seed = settings.seed;
  }
  try {
    auto error =
        evaluate_removal_of_run(source, fs::path(arguments.out) / runs.front()->folder, {stop, true});
    if (error && error->interrupted) return std::nullopt;
    return error;
  } catch (const InputError& error) {
    std::fprintf(stderr, "note: %s: the removal cannot be evaluated: %s\n", sequence.name.c_str(),
                 error.what());
    return std::nullopt;
  }
}

// Sequences composed from the same recording have the same static counterpart, which is run only once.
std::vector<BenchmarkedSequence> known_runs(const DynamicReport& report,
                                            const BenchmarkSequence& counterpart) {
  if (counterpart.is_simulated()) return {};
  for (const auto& result : report.results) {
    if (result.counterpart_by_mode.size() != report.modes.size()) continue;
    const BenchmarkSequence& known = result.counterpart_by_mode.front().sequence;
    if (!has_same_frames(known, counterpart)) continue;
    auto runs = result.counterpart_by_mode;
    for (auto& run : runs) run.sequence.name = counterpart.name;
    return runs;
  }
  return {};
}

void measure_modes(const DynamicSequence& pair, const BenchmarkArguments& arguments, DynamicReport& report,
                   const std::stop_token& stop) {
  auto counterpart_runs =
      pair.counterpart ? known_runs(report, *pair.counterpart) : std::vector<BenchmarkedSequence>{};
  const bool runs_counterpart = pair.counterpart && counterpart_runs.empty();
  report.results.push_back(
      {pair.sequence, pair.counterpart.has_value(), {}, std::move(counterpart_runs), {}, ""});
  DynamicResult& result = report.results.back();
  for (const auto& mode : report.modes) {
    BenchmarkSettings settings = arguments.settings;
    settings.dynamic = mode;
    const auto add = [&](const BenchmarkSequence& sequence, std::vector<BenchmarkedSequence>& to) {
      if (stop.stop_requested()) return;
      to.push_back(measure(sequence, settings, sequence.name + "-" + mode, arguments, stop));
      report.is_interrupted = stop.stop_requested();
      write_report(report, arguments.out);
    };
    add(pair.sequence, result.by_mode);
    if (stop.stop_requested()) break;
    result.removal.push_back(removal_of(result.by_mode.back(), settings, arguments, stop));
    if (runs_counterpart) {
      settings.traffic = "none";
      add(*pair.counterpart, result.counterpart_by_mode);
    }
  }
  if (const cv::Mat figure = figure_of(result, report.modes); !figure.empty()) {
    result.figure = pair.sequence.name + ".png";
    write_png(fs::path(arguments.out) / result.figure, figure);
  }
}

void require_weights(const std::vector<std::string>& modes) {
  const bool needs_labels =
      std::any_of(modes.begin(), modes.end(), [](const auto& mode) { return options_of_mode(mode)->labels; });
  if (needs_labels && find_segmentation_model().empty()) throw missing_segmentation_model();
}

void execute(DynamicArguments arguments, const std::string& version) {
  const InterruptWatcher interrupt;
  BenchmarkArguments& common = arguments.common;
  const fs::path out = common.out;
  const auto folder = benchmark_folder(common);
  if (std::set<std::string>(arguments.modes.begin(), arguments.modes.end()).size() != arguments.modes.size())
    throw CLI::ValidationError("--modes", "names a mode twice");
  // Errors that would fail every run are found before the first.
  if (!common.settings.config.empty()) read_options(common.settings.config);
  require_weights(arguments.modes);
  const auto pairs = find_dynamic_sequences({common.sequences, arguments.counterparts, common.camera,
                                             arguments.tum, common.settings.traffic != "none"},
                                            out);
  DynamicReport report{header_of(common, version), arguments.modes, {}, ""};
  write_report(report, out);
  for (const auto& pair : pairs) {
    if (interrupt.token().stop_requested()) break;
    measure_modes(pair, common, report, interrupt.token());
    report.is_interrupted = interrupt.token().stop_requested();
    write_report(report, out);
  }
  if (report.is_interrupted) std::fprintf(stderr, "interrupted: the report holds the complete runs\n");
  std::cout << (common.json ? dynamic_json(report) : dynamic_summary(report));
  if (!common.json) std::cout << "results: " << (out / "benchmark.md").string() << "\n";
  require_written_output();
  for (const auto& result : report.results) {
    for (const auto& sequence : result.by_mode) throw_if_any_failed(sequence);
    for (const auto& sequence : result.counterpart_by_mode) throw_if_any_failed(sequence);
  }
}
}  // namespace

void add_benchmark_dynamic_command(CLI::App& benchmark, const std::string& version) {
  auto* command = benchmark.add_subcommand(
      "dynamic",
      "Run dynamic sequences in each mode of --dynamic, and their static counterparts; compare the accuracy");
  const auto arguments = std::make_shared<DynamicArguments>();
  arguments->common.settings.traffic = "heavy";
  add_benchmark_options(*command, arguments->common);
  const auto* sequences = command->get_option("--sequences");
  command
      ->add_option("--modes", arguments->modes,
                   "Detection of dynamic objects: values of --dynamic of roslam run")
      ->check(CLI::IsMember(dynamic_modes()))
      ->capture_default_str();
  command
      ->add_option(
          "--counterparts,--twins", arguments->counterparts,
          "Static counterparts, one for each of --sequences; - and default: those that simulated and "
          "composed sequences have")
      ->type_name("DIR");
  command
      ->add_option("--tum", arguments->tum,
                   "Folder filled by scripts/get_tum: run its sequences of table 3 of the paper")
      ->type_name("DIR");
  command->footer(kExamples);
  command->callback([arguments, sequences, version] {
    // The simulated street is the default only if no sequence is given.
    if (sequences->empty() && !arguments->tum.empty()) arguments->common.sequences.clear();
    execute(*arguments, version);
  });
}

}  // namespace roslam::app
