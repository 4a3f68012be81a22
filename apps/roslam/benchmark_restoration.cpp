// SPDX-License-Identifier: BSD-3-Clause
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>

#include "apps/roslam/benchmark.hpp"
#include "apps/roslam/interrupt.hpp"
#include "apps/roslam/output.hpp"
#include "apps/roslam/restoration_benchmark.hpp"
#include "roslam/error.hpp"
#include "roslam/write_file.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

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

void execute(RestorationBenchmarkSettings settings, const std::string& version) {
  const InterruptWatcher interrupt;
  const fs::path out = settings.common.out;
  make_folder(out);
  const auto sequences = find_sequences(settings.common.sequences, settings.common.camera);
  if (!settings.truth.empty() && sequences.size() != 1)
    throw CLI::ValidationError("--truth", "is of one sequence; give one");
  RestorationReport report{header_of(settings.common, version), settings.every, {}};
  const auto write = [&] {
    report.is_interrupted = interrupt.token().stop_requested();
    write_file(out / "benchmark.md", restoration_markdown(report));
    write_file(out / "benchmark.json", restoration_json(report));
  };
  write();
  for (const auto& sequence : sequences) {
    if (interrupt.token().stop_requested()) break;
    report.sequences.push_back(measure_restoration(sequence, settings, interrupt.token()));
    write();
  }
  std::cout << (settings.common.json ? restoration_json(report) : restoration_markdown(report));
  if (!settings.common.json) std::cout << "\nresults: " << (out / "benchmark.md").string() << "\n";
  require_written_output();
  for (const auto& sequence : report.sequences)
    if (!sequence.failure.empty()) throw InputError(sequence.sequence.name + ": " + sequence.failure);
}
}  // namespace

void add_benchmark_restoration_command(CLI::App& benchmark, const std::string& version) {
  auto* command = benchmark.add_subcommand(
      "restoration",
      "Restore sequences by each method and compare with what really is behind the moving things.");
  const auto settings = std::make_shared<RestorationBenchmarkSettings>();
  BenchmarkArguments& common = settings->common;
  common.settings.traffic = "heavy";
  command
      ->add_option("--sequences", common.sequences,
                   "What to restore: FOLDER, FOLDER:CAMERA or simulated:FLIGHT")
      ->type_name("DIR")
      ->capture_default_str();
  command->add_option("--camera", common.camera,
                      "Camera of the folders that name none: a preset or a YAML file");
  command->add_option("--out", common.out, "Folder the report is written to; made if it does not exist")
      ->required()
      ->type_name("DIR");
  command->add_option("--methods", settings->methods, "Values of --method of `roslam restore`")
      ->check(CLI::IsMember(settings->methods))
      ->capture_default_str();
  command->add_option("--every", settings->every, "Restore one frame in so many")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--truth", settings->truth, "The frames of the sequence without what moves")
      ->type_name("DIR");
  command
      ->add_option("--truth-depth-units", settings->depth_units,
                   "Value of the true depth images at one metre")
      ->check(CLI::PositiveNumber);
  command->add_option("--traffic", common.settings.traffic, "Of simulated flights: none, light or heavy")
      ->check(CLI::IsMember({"none", "light", "heavy"}))
      ->capture_default_str();
  command->add_option("--frames", common.settings.frames, "Of simulated flights; 0 = all")
      ->capture_default_str();
  command->add_option("--seed", common.settings.seed, "Of simulated flights")->capture_default_str();
  command->add_flag("--quiet", common.quiet, "No progress");
  command->add_flag("--json", common.json, "Print the report as one JSON object");
  command->footer(kExamples);
  command->callback([settings, version] { execute(*settings, version); });
}

}  // namespace roslam::app
