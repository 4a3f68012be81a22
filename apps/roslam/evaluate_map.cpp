// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "apps/roslam/evaluate.hpp"
#include "apps/roslam/map_evaluation.hpp"
#include "apps/roslam/output.hpp"
#include "roslam/error.hpp"

namespace roslam::app {

namespace {
constexpr auto kExamples = R"(Examples:
  A simulated flight, whose background is known:
    roslam simulate street --traffic heavy --frames 300 --out street
    roslam run street --camera street/camera.yaml --out removed
    roslam evaluate map --truth street --estimate removed
  Two maps beside each other, with the map of the same flight without traffic as what could be had; for a script:
    roslam evaluate map --truth street --estimate plain=run-1 restored=run-2 --reference no_traffic --json
  People composed into a recording, which is the background:
    roslam compose my_room --camera d435 --people people --out with_people
    roslam run with_people --camera with_people/camera.yaml --out run
    roslam evaluate map --truth with_people --estimate run
  With a truth without noise, of the same flight:
    roslam simulate street --traffic heavy --frames 300 --depth ideal --out exact
    roslam evaluate map --truth street --background exact --estimate removed

  With a cloud of the static scene that lies in the world of the map, as a laser scanner gives it:
    roslam evaluate map --truth scan.ply --estimate removed/dense.ply

A run needs dense.ply and trajectory.txt; poses of equal times put its map into the world of groundtruth.txt.
Accuracy is the share of the map's points near the static truth, completeness the share of the truth near the map.
Ghosts are points near to what moved and far from what is static; points on parked cars and the like are right
either way and reported apart. Holes are the truth with nothing of the map within 15 cm.
Noise in the truth's depth makes accuracy look better and completeness worse.
Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

struct Arguments {
  MapEvaluationSettings settings;
  std::vector<std::string> estimates;
  double truth_depth_units = 0.0;
  bool json = false;
};

void run(const Arguments& arguments) {
  MapEvaluationSettings settings = arguments.settings;
  settings.estimates = parse_named(arguments.estimates);
  make_names_differ({&settings.estimates});
  settings.quiet |= arguments.json;
  std::error_code error;
  const MapSequenceSettings& truth = settings.truth;
  if (std::filesystem::is_regular_file(truth.sequence, error) &&
      !(truth.background.empty() && truth.camera.empty()))
    throw CLI::ValidationError("--truth", "is a PLY file, which needs neither --background nor --camera");
  if (arguments.truth_depth_units > 0.0) settings.truth.background_depth_units = arguments.truth_depth_units;
  const auto maps = evaluate_maps(settings);
  std::cout << (arguments.json ? to_json(maps, settings.truth_options, settings.error_options)
                               : to_markdown(maps));
  require_written_output();
}

// What the library would refuse is refused here, with exit code 2.
void require_options(MapEvaluationSettings& settings) {
  settings.truth_options.far_range = std::max(MapTruthOptions{}.far_range, settings.truth_options.range);
  try {
    settings.truth_options.validate();
  } catch (const OptionsError& error) {
    throw CLI::ValidationError("--range", error.what());
  }
  try {
    settings.error_options.validate();
  } catch (const OptionsError& error) {
    throw CLI::ValidationError("--tolerance", error.what());
  }
}

void add_truth_options(CLI::App& command, Arguments& arguments) {
  MapSequenceSettings& truth = arguments.settings.truth;
  command
      .add_option(
          "--truth", truth.sequence,
          "A sequence that roslam simulate or compose wrote, any in the TUM format with groundtruth.txt "
          "and --background, or a PLY file in the world of the maps")
      ->required()
      ->type_name("PATH");
  command
      .add_option(
          "--background", truth.background,
          "Take the static scene from this folder instead: what roslam simulate or compose wrote of the "
          "same flight, or the recording without what moves")
      ->type_name("DIR");
  command.add_option("--camera", truth.camera,
                     "A preset or a YAML file; default the camera.yaml of the truth");
  command
      .add_option("--truth-depth-units", arguments.truth_depth_units,
                  "Value of the background's depth images at one metre; default as a file beside them says")
      ->check(CLI::PositiveNumber);
  command.add_option("--every", arguments.settings.every, "Use one frame of the truth in so many")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}
}  // namespace

void add_evaluate_map_command(CLI::App& evaluate) {
  auto* command = evaluate.add_subcommand("map", "Compare dense maps with what is static.");
  const auto arguments = std::make_shared<Arguments>();
  MapEvaluationSettings& settings = arguments->settings;
  add_truth_options(*command, *arguments);
  command
      ->add_option("--estimate", arguments->estimates,
                   "Run folders or dense maps in them, also as NAME=PATH; a column of the table each")
      ->required()
      ->type_name("PATH");
  command
      ->add_option(
          "--reference", settings.reference,
          "A run folder whose map is what could be had, as of the same flight with nothing moving: what "
          "it covers and an estimate does not is missing")
      ->type_name("DIR");
  command
      ->add_option("--range", settings.truth_options.range,
                   "Metres before a frame up to which a map should have what it sees")
      ->capture_default_str();
  command
      ->add_option("--tolerance", settings.error_options.tolerance,
                   "Metres up to which points are the same place")
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print one JSON object instead of tables");
  command->add_flag("--quiet", settings.quiet, "No progress");
  command->footer(kExamples);
  command->callback([arguments] {
    require_options(arguments->settings);
    run(*arguments);
  });
}

}  // namespace roslam::app
