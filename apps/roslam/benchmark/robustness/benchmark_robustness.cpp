// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>
#include <stop_token>
#include <utility>

#include "apps/roslam/benchmark/benchmark.hpp"
#include "apps/roslam/benchmark/benchmark_metrics.hpp"
#include "apps/roslam/benchmark/benchmark_sequences.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/dynamic_objects/dynamic_object_options.hpp"
#include "simulation/degraded_source.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr auto kExamples = R"(Examples:
  The simulated street, nothing to download:
    roslam benchmark robustness --out results
  A recording with its camera after a colon, with and without removal of dynamic objects:
    roslam benchmark robustness --sequences rgbd_dataset_freiburg1_rpy:tum-fr1 --modes none both --out results

Each sequence is run as it is and under each condition: each 2nd to 5th image only (every-2 to every-5), motion
blur in a third of the images (blur), steps of the exposure (exposure), bursts of 0.2 to 1 s without images
(bursts), half the features (half-features). A frame is wrong if it is tracked, but its motion since the tracked
frame before differs from the true one by more than 0.08 m or 4 degrees.
Writes to the folder DIR of --out: benchmark.md, benchmark.json, and the folder of each run to runs/.
Ctrl-C ends the benchmark and writes the results so far.
Exit code: 0 success, 1 an error in the input or a run that failed, 2 wrong usage.)";

constexpr auto kHalfFeatures = "half-features";

std::vector<std::string> all_conditions() {
  auto conditions = simulation::degradation_names();
  conditions.emplace_back(kHalfFeatures);
  return conditions;
}

struct RobustnessArguments {
  BenchmarkArguments common;
  std::vector<std::string> modes{"none"};
  std::vector<std::string> conditions = all_conditions();
};

/// A sequence under one condition.
struct Measured {
  std::string condition;
  BenchmarkedSequence result;
};

/// A sequence in one mode of --dynamic.
struct SequenceInMode {
  std::string sequence;
  std::string mode;
  std::vector<Measured> conditions;
};

struct RobustnessReport {
  BenchmarkHeader header;
  std::vector<SequenceInMode> sequences;
};

std::string table_of(const SequenceInMode& sequence) {
  const std::set<std::string> shown{"frames", "tracked_share", "wrong_frames", "ate_rmse_m",
                                    "rpe_frame_rmse_m"};
  auto metrics = benchmark_metrics();
  std::erase_if(metrics, [&](const Metric& metric) { return shown.count(metric.key) == 0; });
  std::vector<TableRow> rows{{"condition"}};
  for (const Metric& metric : metrics) rows.front().push_back(metric.title);
  for (const auto& [condition, result] : sequence.conditions) {
    rows.push_back({condition});
    for (const Metric& metric : metrics) rows.back().push_back(metric.cell(median_of(result, metric.of)));
  }
  return markdown_table(rows);
}

std::string markdown(const RobustnessReport& report) {
  std::string text = R"(# Robustness

Conditions: as taken (none), each 2nd to 5th image, motion blur in a third of the images, steps of the exposure,
bursts without images, half the features. A frame is wrong if it is tracked, but its motion since the tracked frame
before is off by more than 0.08 m or 4 degrees.
)";
  for (const auto& sequence : report.sequences) {
    text += "\n## " + table_cell(sequence.sequence) + ", --dynamic " + sequence.mode + "\n\n";
    text += table_of(sequence);
  }
  if (report.header.is_interrupted) text += "\nInterrupted: these are the complete runs.\n";
  return text;
}

std::string json_text(const RobustnessReport& report) {
  Json json = head_json("robustness", report.header);
  json["sequences"] = Json::array();
  for (const auto& sequence : report.sequences) {
    Json conditions = Json::object();
    for (const auto& [condition, result] : sequence.conditions) conditions[condition] = json_of(result);
    json["sequences"].push_back(
        {{"name", sequence.sequence}, {"dynamic", sequence.mode}, {"conditions", conditions}});
  }
  return text_of(json);
}

void write_report(const RobustnessReport& report, const fs::path& out) {
  write_file(out / "benchmark.md", markdown(report));
  write_file(out / "benchmark.json", json_text(report));
}

// Each condition with the settings of its runs; half the features need an options file of their own.
std::vector<std::pair<std::string, BenchmarkSettings>> conditions_of(const RobustnessArguments& arguments) {
  std::vector<std::pair<std::string, BenchmarkSettings>> conditions;
  for (const std::string& condition : arguments.conditions) {
    BenchmarkSettings settings = arguments.common.settings;
    if (condition == kHalfFeatures) {
      Options options = settings.config.empty() ? Options{} : read_options(settings.config);
      options.orb.features /= 2;
      const fs::path file = fs::path(arguments.common.out) / "runs" / "half-features.yaml";
      make_folder(file.parent_path());
      write_file(file, options_to_yaml(options));
      settings.config = file.string();
    } else {
      settings.degrade = condition;
    }
    conditions.emplace_back(condition, settings);
  }
  return conditions;
}

void measure_all(const RobustnessArguments& arguments, const std::stop_token& stop,
                 RobustnessReport& report) {
  const auto conditions = conditions_of(arguments);
  for (const auto& sequence : find_sequences(arguments.common.sequences, arguments.common.camera)) {
    for (const std::string& mode : arguments.modes) {
      report.sequences.push_back({sequence.name, mode, {}});
      for (auto [condition, settings] : conditions) {
        settings.dynamic = mode;
        const std::string name = sequence.name + "-" + mode + "-" + condition;
        report.sequences.back().conditions.push_back(
            {condition, measure(sequence, settings, name, arguments.common, stop)});
        report.header.is_interrupted = stop.stop_requested();
        write_report(report, arguments.common.out);
        if (stop.stop_requested()) return;
      }
    }
  }
}

void execute(const RobustnessArguments& arguments, const std::string& version) {
  const InterruptWatcher interrupt;
  const fs::path out = arguments.common.out;
  const auto folder = benchmark_folder(arguments.common);
  if (!arguments.common.settings.config.empty()) read_options(arguments.common.settings.config);
  RobustnessReport report{header_of(arguments.common, version), {}};
  measure_all(arguments, interrupt.token(), report);
  std::cout << (arguments.common.json ? json_text(report) : markdown(report));
  if (!arguments.common.json) std::cout << "\nresults: " << (out / "benchmark.md").string() << "\n";
  require_written_output();
  for (const auto& sequence : report.sequences) {
    for (const auto& measured : sequence.conditions) throw_if_any_failed(measured.result);
  }
}
}  // namespace

void add_benchmark_robustness_command(CLI::App& benchmark, const std::string& version) {
  auto* command = benchmark.add_subcommand(
      "robustness", "Run sequences with fewer, blurred, brighter or missing images; count wrong poses");
  const auto arguments = std::make_shared<RobustnessArguments>();
  arguments->common.runs = 1;
  add_benchmark_options(*command, arguments->common);
  command->add_option("--modes", arguments->modes, "Modes of --dynamic to run each sequence in")
      ->check(CLI::IsMember(dynamic_modes()))
      ->capture_default_str();
  command->add_option("--conditions", arguments->conditions, "Conditions to run each sequence under")
      ->check(CLI::IsMember(all_conditions()))
      ->capture_default_str();
  command->footer(kExamples);
  command->callback([arguments, version] { execute(*arguments, version); });
}

}  // namespace roslam::app
