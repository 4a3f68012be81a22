// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <iostream>
#include <memory>

#include "apps/roslam/benchmark.hpp"
#include "apps/roslam/interrupt.hpp"
#include "apps/roslam/map_benchmark.hpp"
#include "apps/roslam/output.hpp"
#include "roslam/error.hpp"
#include "roslam/write_file.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

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
  const fs::path out = settings.common.out;
  make_folder(out);
  const auto sequences = find_sequences(settings.common.sequences, settings.common.camera);
  if (!settings.truth.empty() && sequences.size() != 1)
    throw CLI::ValidationError("--truth", "is of one sequence; give one");
  if (!settings.truth.empty() && sequences.front().is_simulated())
    throw CLI::ValidationError("--truth", "is known of a simulated flight; leave it out");
  MapBenchmarkReport report{header_of(settings.common, version), settings.range, {}};
  const auto write = [&] {
    report.is_interrupted = interrupt.token().stop_requested();
    write_file(out / "benchmark.md", map_benchmark_markdown(report));
    write_file(out / "benchmark.json", map_benchmark_json(report));
  };
  write();
  for (const auto& sequence : sequences) {
    if (interrupt.token().stop_requested()) break;
    report.sequences.push_back(measure_maps(sequence, settings, interrupt.token()));
    write();
  }
  std::cout << (settings.common.json ? map_benchmark_json(report) : map_benchmark_markdown(report));
  if (!settings.common.json) std::cout << "\nresults: " << (out / "benchmark.md").string() << "\n";
  require_written_output();
  for (const auto& sequence : report.sequences)
    if (!sequence.failure.empty()) throw InputError(sequence.sequence.name + ": " + sequence.failure);
}

void add_flight_settings(CLI::App& command, BenchmarkSettings& flight) {
  command.add_option("--traffic", flight.traffic, "Of simulated flights: none, light or heavy")
      ->check(CLI::IsMember({"none", "light", "heavy"}))
      ->capture_default_str();
  command.add_option("--frames", flight.frames, "Of simulated flights; 0 = all")->capture_default_str();
  command.add_option("--seed", flight.seed, "Of simulated flights")->capture_default_str();
  command.add_option("--config", flight.config, "YAML file with options of the runs");
}
}  // namespace

void add_benchmark_map_command(CLI::App& benchmark, const std::string& version) {
  auto* command = benchmark.add_subcommand(
      "map", "Map sequences densely, with and without each step, and compare with what is static.");
  const auto settings = std::make_shared<MapBenchmarkSettings>();
  BenchmarkArguments& common = settings->common;
  common.settings.traffic = "light";
  command
      ->add_option("--sequences", common.sequences, "What to map: FOLDER, FOLDER:CAMERA or simulated:FLIGHT")
      ->type_name("DIR")
      ->capture_default_str();
  command->add_option("--camera", common.camera,
                      "Camera of the folders that name none: a preset or a YAML file");
  command->add_option("--out", common.out, "Folder the report is written to; made if it does not exist")
      ->required()
      ->type_name("DIR");
  command->add_option("--truth", settings->truth, "The frames of the sequence without what moves")
      ->type_name("DIR");
  command
      ->add_option("--truth-depth-units", settings->depth_units,
                   "Value of the true depth images at one metre")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--range", settings->range,
                   "Metres before a frame up to which a map should have what it sees")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  add_flight_settings(*command, common.settings);
  command->add_flag("--quiet", common.quiet, "No progress");
  command->add_flag("--json", common.json, "Print the report as one JSON object");
  command->footer(kExamples);
  command->callback([settings, version] { execute(*settings, version); });
}

}  // namespace roslam::app
