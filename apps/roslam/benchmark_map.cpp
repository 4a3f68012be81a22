// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include "apps/roslam/benchmark.hpp"
#include "apps/roslam/map_benchmark.hpp"

namespace roslam::app {

namespace {
constexpr auto kExamples = R"(Examples:
  The simulated street, nothing to download:
    roslam benchmark map --traffic light --frames 450 --out results
  People composed into a recording, whose true depth has 1000 units a metre:
    roslam compose my_room --camera 7scenes --people people --out with_people
    roslam benchmark map --sequences with_people:7scenes --truth my_room --truth-depth-units 1000 --range 4 --out results

Five maps are made of each sequence: as taken, with what moves removed, and what other views show put in, and the rest
invented (what roslam run writes), and of the same flight with nothing that moves.
DIR then holds benchmark.md with tables, benchmark.json, pictures of the maps, and what was flown under runs/.
Ctrl-C ends the benchmark and writes what there is.
Exit code: 0 success, 1 an error in the input or a sequence that failed, 2 wrong usage.)";

void execute(const MapBenchmarkSettings& settings, const std::string& version) {
  const InterruptWatcher interrupt;
  make_folder(settings.common.out);
  const auto sequences = sequences_of(settings);
  if (!settings.truth.empty() && sequences.front().is_simulated())
    throw CLI::ValidationError("--truth", "is known of a simulated flight; leave it out");
  run_truth_benchmark(
      settings.common, sequences, interrupt,
      MapBenchmarkReport{header_of(settings.common, version), settings.range, {}},
      [&](const BenchmarkSequence& sequence) { return measure_maps(sequence, settings, interrupt.token()); },
      map_benchmark_markdown, map_benchmark_json);
}
}  // namespace

void add_benchmark_map_command(CLI::App& benchmark, const std::string& version) {
  auto* command = benchmark.add_subcommand(
      "map", "Map sequences densely, with and without each step, and compare with what is static.");
  const auto settings = std::make_shared<MapBenchmarkSettings>();
  settings->common.settings.traffic = "light";
  add_truth_benchmark_options(*command, *settings, "What to map: FOLDER, FOLDER:CAMERA or simulated:FLIGHT");
  command
      ->add_option("--range", settings->range,
                   "Metres before a frame up to which a map should have what it sees")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--config", settings->common.settings.config, "YAML file with options of the runs");
  command->footer(kExamples);
  command->callback([settings, version] { execute(*settings, version); });
}

}  // namespace roslam::app
