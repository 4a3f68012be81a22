// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/benchmark/scene/truth_benchmark.hpp"

namespace roslam::app {

void add_truth_benchmark_options(CLI::App& command, TruthBenchmarkSettings& settings,
                                 const std::string& sequences_help) {
  BenchmarkArguments& common = settings.common;
  BenchmarkSettings& flight = common.settings;
  command.add_option("--sequences", common.sequences, sequences_help)
      ->type_name("DIR")
      ->capture_default_str();
  command.add_option("--camera", common.camera,
                     "Camera of folders given without one: a preset or a YAML file");
  command.add_option("--out", common.out, "Folder the report is written to; made if it does not exist")
      ->required()
      ->type_name("DIR");
  command.add_option("--truth", settings.truth, "Folder of the same frames without dynamic objects")
      ->type_name("DIR");
  command
      .add_option("--truth-depth-units", settings.depth_units,
                  "Value of the depth images of --truth at one metre; default as stated beside them")
      ->check(CLI::PositiveNumber);
  command.add_option("--traffic", flight.traffic, "Traffic of simulated flights: none, light or heavy")
      ->check(CLI::IsMember({"none", "light", "heavy"}))
      ->capture_default_str();
  command.add_option("--frames", flight.frames, "Number of frames of simulated flights; 0 = all")
      ->capture_default_str();
  command.add_option("--seed", flight.seed, "Seed of simulated flights")->capture_default_str();
  command.add_flag("--quiet", common.quiet, "Print no progress");
  command.add_flag("--json", common.json, "Print the report as one JSON object on stdout");
}

std::vector<BenchmarkSequence> sequences_of(const TruthBenchmarkSettings& settings) {
  auto sequences = find_sequences(settings.common.sequences, settings.common.camera);
  if (!settings.truth.empty() && sequences.size() != 1)
    throw CLI::ValidationError("--truth", "is of one sequence; give only one");
  return sequences;
}

}  // namespace roslam::app
