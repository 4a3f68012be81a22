// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/roslam/composition.hpp"
#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "recording/output_folder.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "simulation/composition/composer.hpp"

namespace roslam::app {

using namespace evaluation;
using namespace simulation;
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct ComposeArguments {
  CompositionSettings settings;
  std::string camera;
  fs::path people;
  ComposerOptions options;
  std::array<double, 2> distance{1.3, 2.4};
  std::array<double, 3> up{};  // 0 0 0: estimated from the sequence
  bool overwrite = false;
  bool json = false;
};

constexpr const char* kHelp =
    R"(The pixels of the people and the background behind them are known exactly, which no recording offers.
Reads a TUM RGB-D folder of a static scene with groundtruth.txt, and images of people. Writes a TUM RGB-D
folder that `roslam run` accepts. The result is a composite, not a recording: say so with any figures of it.

Example:
  roslam compose rgbd_dataset_freiburg1_rpy --camera tum-fr1 --people people --up 0 0 1 --out rpy_people
  roslam run rpy_people --camera rpy_people/camera.yaml --out rpy_people_run

Each image in the folder of --people shows one standing person from head to feet: NAME.jpg or NAME.png, with
NAME_mask.png (8 bit, 255 = person).

Writes to the folder of --out; images are named after their timestamp in seconds:
  rgb/ rgb.txt            colour
  depth/ depth.txt        depth, 16 bit, --depth-units per metre, 0 = unknown
  groundtruth.txt         camera poses: timestamp (s), position (m), quaternion x y z w
  camera.yaml             camera parameters, for --camera of roslam run
  labels/                 8 bit: 11 (person) on actors, 255 (unknown) elsewhere
  instances/              16 bit: number of the actor, from 1; 0 = none
  background.txt          timestamp and colour image of each frame without people, relative to the folder
  background_depth.txt    the same for the depth images, in the depth units of the input
  composition.json        the actors and all options in effect

Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

std::vector<PersonCutout> read_people(const ComposeArguments& arguments) {
  if (arguments.options.actors == 0) return {};
  const auto files = people_in(arguments.people);
  std::vector<PersonCutout> people;
  for (const std::size_t i : chosen_people(files.size(), arguments.options)) {
    people.push_back(read_person(files[i]));
  }
  return people;
}

Json json_of(const ComposerOptions& options) {
  Json json{{"actors", options.actors},
            {"seed", options.seed},
            {"distance", {options.min_distance, options.max_distance}},
            {"span", options.span},
            {"camera_height", options.camera_height},
            {"height", {options.min_height, options.max_height}},
            {"speed", {options.min_speed, options.max_speed}},
            {"thickness", options.thickness},
            {"noise_floor", options.noise_floor},
            {"noise_growth", options.noise_growth},
            {"shadow_baseline", options.shadow_baseline}};
  return json;
}

Json summary_json(const ComposeArguments& arguments, const Composer& composer, const Camera& base,
                  const Composition& made) {
  const Eigen::Vector3d& up = composer.ground().up();
  Json json{{"base", arguments.settings.folder.string()},
            {"frames", made.times.size()},
            {"interrupted", made.interrupted},
            {"covered_mean", made.mean()},
            {"covered_most", made.most()},
            {"skipped", made.skipped},
            {"depth_units_per_metre", arguments.settings.depth_units_per_metre},
            {"background_depth_units_per_metre", base.depth_units_per_metre},
            {"depth_pixels_too_far", made.too_far},
            {"options", json_of(arguments.options)},
            {"up", {up.x(), up.y(), up.z()}},
            {"actors", Json::array()}};
  for (const auto& actor : composer.actors()) {
    json["actors"].push_back(
        {{"name", actor.name}, {"height", actor.person.height()}, {"width", actor.person.width()}});
  }
  return json;
}

void print_summary(const ComposeArguments& arguments, const Composition& made) {
  std::cout << "wrote " << made.times.size() << " frames to " << arguments.settings.out.string()
            << (made.interrupted ? ", interrupted" : "") << "; actors cover " << fixed(100.0 * made.mean(), 1)
            << " % of the image on average, " << fixed(100.0 * made.most(), 1) << " % at most\n";
  for (const auto& [reason, count] : made.skipped) std::cout << "skipped " << count << ": " << reason << "\n";
}

void warn(const ComposeArguments& arguments, const Composition& made) {
  if (arguments.options.actors > 0 && made.most() == 0.0) {
    std::cerr
        << "note: no actor is ever seen: the scene is nearer than the actors; give a smaller --distance\n";
  }
  if (made.too_far > 0) {
    std::cerr << "note: " << made.too_far << " pixels are farther than "
              << fixed(65535.0 / arguments.settings.depth_units_per_metre, 1)
              << " m, the largest value of a 16-bit depth image; give a smaller --depth-units\n";
  }
}

void compose(ComposeArguments arguments) {
  const InterruptWatcher interrupt;
  arguments.options.min_distance = arguments.distance[0];
  arguments.options.max_distance = arguments.distance[1];
  const Eigen::Vector3d up(arguments.up[0], arguments.up[1], arguments.up[2]);
  if (!up.isZero(0.0)) arguments.options.up = up;
  if (arguments.people.empty() && arguments.options.actors > 0) throw CLI::RequiredError("--people");
  arguments.options.validate();
  const Camera base = load_camera(arguments.camera);
  TumSource source(arguments.settings.folder, base);
  const Trajectory truth = read_truth(arguments.settings.folder);
  if (!arguments.options.up) arguments.options.up = find_up(arguments.settings.folder, base, truth);
  const Composer composer(base, read_people(arguments), truth, arguments.options);
  protect_base(arguments.settings);
  const recording::OutputFolder out(
      arguments.settings.out, "compose",
      {"rgb.txt", "depth.txt", "groundtruth.txt", "camera.yaml", "background.txt", "background_depth.txt",
       "composition.json", "rgb", "depth", "labels", "instances"},
      arguments.overwrite);
  for (const char* folder : {"rgb", "depth", "labels", "instances"})
    make_folder(arguments.settings.out / folder);
  Camera written = base;
  written.depth_units_per_metre = arguments.settings.depth_units_per_metre;
  write_file(arguments.settings.out / "camera.yaml", camera_to_yaml(written));
  const Composition made = write_composition(arguments.settings, composer, source, truth, interrupt.token());
  if (made.times.empty() && !made.interrupted) {
    throw InputError(arguments.settings.folder.string() + ": no frame could be used" +
                     in_words(made.skipped) + "; check the images, groundtruth.txt and --camera");
  }
  Json summary = summary_json(arguments, composer, base, made);
  write_file(arguments.settings.out / "composition.json",
             summary.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
  if (arguments.json) {
    summary["out"] = arguments.settings.out.string();  // not in the file: it would differ by folder
    std::cout << summary.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    print_summary(arguments, made);
  }
  if (!made.times.empty()) warn(arguments, made);
  require_written_output();
}

void add_placement_options(CLI::App& command, ComposeArguments& arguments) {
  command
      .add_option("--distance", arguments.distance, "Distance of the people in front of the camera, metres")
      ->type_name("MIN MAX")
      ->capture_default_str();
  command.add_option("--span", arguments.options.span, "Distance they walk to each side, metres")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command
      .add_option("--camera-height", arguments.options.camera_height,
                  "Mean height of the camera above the floor, metres")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command
      .add_option("--up", arguments.up,
                  "Up direction in the world frame of groundtruth.txt, such as 0 0 1; default: the normal of "
                  "floors and tables, or else the mean up direction of the images")
      ->type_name("X Y Z");
}

}  // namespace

void add_compose_command(CLI::App& program) {
  const auto arguments = std::make_shared<ComposeArguments>();
  CLI::App* command = program.add_subcommand(
      "compose", "Compose walking people into a recorded static sequence, with exact ground truth");
  command->footer(kHelp);
  command
      ->add_option("FOLDER", arguments->settings.folder,
                   "TUM RGB-D folder without people, with groundtruth.txt")
      ->required();
  command
      ->add_option(
          "--camera", arguments->camera,
          "Its camera: a preset (tum-fr1 tum-fr2 tum-fr3 7scenes d435 d455 simulated) or a YAML file")
      ->required();
  command->add_option("--people", arguments->people,
                      "Folder of images of people, each with its mask; not needed for --actors 0");
  command
      ->add_option("--out", arguments->settings.out,
                   "Folder the sequence is written to; made if it does not exist")
      ->required();
  command->add_option("--actors", arguments->options.actors, "Number of people; 0 copies the sequence")
      ->check(CLI::Range(0, 100))
      ->capture_default_str();
  command->add_option("--seed", arguments->options.seed, "Seed of the choice of people and of their paths")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  add_placement_options(*command, *arguments);
  command->add_option("--frames", arguments->settings.frames, "Number of frames to write; default all")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--depth-units", arguments->settings.depth_units_per_metre,
                   "Value of the written depth images at one metre; 5000 reaches 13 m, 1000 reaches 65 m")
      ->check(CLI::Range(1.0, 100000.0))
      ->capture_default_str();
  command->add_flag("--quiet", arguments->settings.quiet, "Print no progress");
  command->add_flag("--overwrite", arguments->overwrite,
                    "Replace files in the folder of --out that this command did not write");
  command->add_flag("--json", arguments->json, "Print the summary as one JSON object");
  command->callback([arguments] { compose(*arguments); });
}

}  // namespace roslam::app
