// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include "apps/roslam/benchmark/benchmark.hpp"
#include "apps/roslam/benchmark/scene/restoration_benchmark.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
constexpr auto kExamples = R"(Examples:
  The simulated street, nothing to download:
    roslam benchmark restoration --out results
  People composed into a recording, whose depth images have 1000 units per metre:
    roslam compose my_room --camera 7scenes --people people --out with_people
    roslam benchmark restoration --sequences with_people --truth my_room --truth-depth-units 1000 \
        --out results

A sequence is FOLDER, FOLDER:CAMERA (TUM RGB-D) or simulated:street, :loop, :hover, :turn, :corridor. The background
behind its dynamic objects must be known: simulated flights and folders of roslam compose have it; for others
--truth names a folder of the same frames without dynamic objects.
Writes to the folder DIR of --out: benchmark.md with tables, benchmark.json, images of each sequence, and the
runs and restored sequences to runs/. Ctrl-C ends the benchmark and writes the results so far.
Exit code: 0 success, 1 an error in the input or a sequence that failed, 2 wrong usage.)";

void execute(const RestorationBenchmarkSettings& settings, const std::string& version) {
  const InterruptWatcher interrupt;
  const auto folder = benchmark_folder(settings.common);
  const auto sequences = sequences_of(settings);
  run_truth_benchmark(
      settings.common, sequences, interrupt,
      RestorationReport{header_of(settings.common, version), settings.every, {}},
      [&](const BenchmarkSequence& sequence) {
        return measure_restoration(sequence, settings, interrupt.token());
      },
      restoration_markdown, restoration_json);
}
}  // namespace

void add_benchmark_restoration_command(CLI::App& benchmark, const std::string& version) {
  auto* command = benchmark.add_subcommand(
      "restoration",
      "Restore sequences by each method; compare them with the true background of the dynamic objects");
  const auto settings = std::make_shared<RestorationBenchmarkSettings>();
  settings->common.settings.traffic = "heavy";
  add_truth_benchmark_options(*command, *settings,
                              "Sequences to restore: FOLDER, FOLDER:CAMERA or simulated:FLIGHT");
  command->add_option("--methods", settings->methods, "Values of --method of roslam restore")
      ->check(CLI::IsMember(settings->methods))
      ->capture_default_str();
  command->add_option("--every", settings->every, "Restore every N-th frame")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->footer(kExamples);
  command->callback([settings, version] { execute(*settings, version); });
}

}  // namespace roslam::app
