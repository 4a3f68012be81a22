// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "apps/roslam/evaluate/evaluate.hpp"
#include "apps/roslam/evaluate/map_evaluation.hpp"
#include "apps/roslam/support/output.hpp"
#include "roslam/common/error.hpp"

namespace roslam::app {

using namespace evaluation;

namespace {
constexpr auto kExamples = R"(Examples:
  A simulated flight, whose background is known:
    roslam simulate street --traffic heavy --frames 300 --out street
    roslam run street --camera street/camera.yaml --out removed
    roslam evaluate map --truth street --estimate removed
  Two maps, with the map of the same flight without traffic as the reference; for a script:
    roslam evaluate map --truth street --estimate plain=run-1 restored=run-2 --reference no_traffic --json
  People composed into a recording, which is the background:
    roslam compose my_room --camera d435 --people people --out with_people
    roslam run with_people --camera with_people/camera.yaml --out run
    roslam evaluate map --truth with_people --estimate run
  With ground truth depth without noise, of the same flight:
    roslam simulate street --traffic heavy --frames 300 --depth ideal --out exact
    roslam evaluate map --truth street --background exact --estimate removed
  With a point cloud of the static scene in the world frame of the map, as of a laser scanner:
    roslam evaluate map --truth scan.ply --estimate removed/dense.ply

A run needs dense.ply and trajectory.txt: SE(3) alignment of its poses aligns its map with groundtruth.txt.
Accuracy is the share of map points within --tolerance of the static truth, completeness the share of the
truth within --tolerance of the map. Ghosts are points near a moving object and far from the static scene.
Points on movable objects at rest, such as parked cars, count neither way and are reported separately. Holes
are parts of the truth with no map point within 15 cm.
Noise in the depth of the truth makes accuracy look better and completeness worse.
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
  make_names_unique({&settings.estimates});
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

// Values the library would refuse are usage errors here (exit code 2).
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
          "A folder of roslam simulate or compose, a TUM RGB-D folder with groundtruth.txt together with "
          "--background, or a PLY file in the world frame of the maps")
      ->required()
      ->type_name("PATH");
  command
      .add_option(
          "--background", truth.background,
          "Take the static scene from this folder instead: one of roslam simulate or compose of the same "
          "flight, or the recording without dynamic objects")
      ->type_name("DIR");
  command.add_option("--camera", truth.camera,
                     "Camera: a preset or a YAML file; default camera.yaml in the folder of the truth");
  command
      .add_option("--truth-depth-units", arguments.truth_depth_units,
                  "Value of the background's depth images at one metre; default as stated beside them")
      ->check(CLI::PositiveNumber);
  command.add_option("--every", arguments.settings.every, "Use every N-th frame of the truth")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}
}  // namespace

void add_evaluate_map_command(CLI::App& evaluate) {
  auto* command = evaluate.add_subcommand("map", "Compare dense maps with the static scene");
  const auto arguments = std::make_shared<Arguments>();
  MapEvaluationSettings& settings = arguments->settings;
  add_truth_options(*command, *arguments);
  command
      ->add_option(
          "--estimate", arguments->estimates,
          "Run folders, or dense maps (PLY) in them, also as NAME=PATH; one column of the table each")
      ->required()
      ->type_name("PATH");
  command
      ->add_option(
          "--reference", settings.reference,
          "Run folder of a reference map, as of the same flight without dynamic objects: what it covers and "
          "an estimate does not is reported as missing")
      ->type_name("DIR");
  command
      ->add_option("--range", settings.truth_options.range,
                   "Distance from a camera pose up to which maps are compared, metres")
      ->capture_default_str();
  command
      ->add_option("--tolerance", settings.error_options.tolerance,
                   "Distance up to which points match, metres")
      ->capture_default_str();
  command->add_flag("--json", arguments->json, "Print one JSON object on stdout instead of tables");
  command->add_flag("--quiet", settings.quiet, "Print no progress");
  command->footer(kExamples);
  command->callback([arguments] {
    require_options(arguments->settings);
    run(*arguments);
  });
}

}  // namespace roslam::app
