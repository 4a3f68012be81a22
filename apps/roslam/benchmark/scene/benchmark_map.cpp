// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include "apps/roslam/benchmark/benchmark.hpp"
#include "apps/roslam/benchmark/scene/map_benchmark.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
constexpr auto kExamples = R"(Examples:
  The simulated street, nothing to download:
    roslam benchmark map --traffic light --frames 450 --out results
  People composed into a recording, whose depth images have 1000 units per metre:
    roslam compose my_room --camera 7scenes --people people --out with_people
    roslam benchmark map --sequences with_people:7scenes --truth my_room --truth-depth-units 1000 --range 4 \
        --out results

Five dense maps are made of each sequence: no rejection, images fused as taken; rejection only, movable
objects left out; with reprojection, holes also filled from other images; all stages, the remaining holes
inpainted (the default of roslam run); empty scene, of the same sequence without movable objects. Each is
compared with the static ground truth as by roslam evaluate map.
Writes to the folder DIR of --out: benchmark.md with tables, benchmark.json, images of the maps, and the
sequences and runs to runs/. Ctrl-C ends the benchmark and writes the results so far.
Exit code: 0 success, 1 an error in the input or a sequence that failed, 2 wrong usage.)";

void execute(const MapBenchmarkSettings& settings, const std::string& version) {
  const InterruptWatcher interrupt;
  const auto folder = benchmark_folder(settings.common);
  const auto sequences = sequences_of(settings);
  if (!settings.truth.empty() && sequences.front().is_simulated())
    throw CLI::ValidationError("--truth", "is rendered for a simulated flight; leave it out");
  run_truth_benchmark(
      settings.common, sequences, interrupt,
      MapBenchmarkReport{header_of(settings.common, version), settings.range, {}},
      [&](const BenchmarkSequence& sequence) { return measure_maps(sequence, settings, interrupt.token()); },
      map_benchmark_markdown, map_benchmark_json);
}
}  // namespace

void add_benchmark_map_command(CLI::App& benchmark, const std::string& version) {
  auto* command = benchmark.add_subcommand(
      "map", "Build dense maps of sequences with each stage; compare them with the static ground truth");
  const auto settings = std::make_shared<MapBenchmarkSettings>();
  settings->common.settings.traffic = "light";
  add_truth_benchmark_options(*command, *settings,
                              "Sequences to map: FOLDER, FOLDER:CAMERA or simulated:FLIGHT");
  command
      ->add_option("--range", settings->range,
                   "Distance from a camera pose up to which the map is compared, metres")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--config", settings->common.settings.config, "YAML file with options for all runs");
  command->footer(kExamples);
  command->callback([settings, version] { execute(*settings, version); });
}

}  // namespace roslam::app
