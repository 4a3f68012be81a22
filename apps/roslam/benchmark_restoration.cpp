// SPDX-License-Identifier: BSD-3-Clause
#include <memory>

#include "apps/roslam/benchmark.hpp"
#include "apps/roslam/restoration_benchmark.hpp"

namespace roslam::app {

namespace {
constexpr auto kExamples = R"(Examples:
  The simulated street, nothing to download:
    roslam benchmark restoration --out results
  People composed into a recording, whose true depth has 1000 units a metre:
    roslam compose my_room --camera 7scenes --people people --out with_people
    roslam benchmark restoration --sequences with_people --truth my_room --truth-depth-units 1000 --out results

A sequence is FOLDER or FOLDER:CAMERA (TUM RGB-D format) or simulated:street, :loop, :hover, :turn. What is behind its
moving things must be known: a simulated flight and what roslam compose wrote know it; for others --truth names a
folder of the same frames without them.
DIR then holds benchmark.md with tables, benchmark.json, pictures of each sequence, and what was flown and restored under
runs/. Ctrl-C ends the benchmark and writes what there is.
Exit code: 0 success, 1 an error in the input or a sequence that failed, 2 wrong usage.)";

void execute(const RestorationBenchmarkSettings& settings, const std::string& version) {
  const InterruptWatcher interrupt;
  make_folder(settings.common.out);
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
      "Restore sequences by each method and compare with what really is behind the moving things.");
  const auto settings = std::make_shared<RestorationBenchmarkSettings>();
  settings->common.settings.traffic = "heavy";
  add_truth_benchmark_options(*command, *settings,
                              "What to restore: FOLDER, FOLDER:CAMERA or simulated:FLIGHT");
  command->add_option("--methods", settings->methods, "Values of --method of `roslam restore`")
      ->check(CLI::IsMember(settings->methods))
      ->capture_default_str();
  command->add_option("--every", settings->every, "Restore one frame in so many")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->footer(kExamples);
  command->callback([settings, version] { execute(*settings, version); });
}

}  // namespace roslam::app
