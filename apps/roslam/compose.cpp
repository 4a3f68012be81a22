// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/roslam/commands.hpp"
#include "apps/roslam/composition.hpp"
#include "apps/roslam/interrupt.hpp"
#include "apps/roslam/output.hpp"
#include "roslam/error.hpp"
#include "roslam/evaluation/markdown_table.hpp"
#include "roslam/sources/composer.hpp"
#include "roslam/sources/tum_source.hpp"
#include "roslam/write_file.hpp"

namespace roslam::app {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct ComposeArguments {
  CompositionSettings settings;
  std::string camera;
  fs::path people;
  ComposerOptions options;
  std::array<double, 2> distance{1.3, 2.4};
  std::array<double, 3> up{};  // 0 0 0: as the camera has it
  bool json = false;
};

constexpr const char* kHelp =
    R"(Put walking people into a recorded static sequence, with everything known about them.

How well a SLAM system copes with people can be measured exactly only where their pixels and what they hide are known.
This takes a TUM RGB-D folder without people and pictures of people, and writes a folder that `roslam run` takes as any
other. It is a composite, not a recording: report figures on it as such.

Example:
  roslam compose rgbd_dataset_freiburg1_rpy --camera tum-fr1 --people people --up 0 0 1 --out rpy_people
  roslam run rpy_people --camera rpy_people/camera.yaml --out rpy_people_run

Each picture of the people shows one standing person from head to feet: NAME.jpg or NAME.png with NAME_mask.png,
8 bit, 255 = person.

Writes to the folder, images named after their time in seconds:
  rgb/ rgb.txt            colour
  depth/ depth.txt        depth, 16 bit, 5000 a metre, 0 = unknown
  groundtruth.txt         camera poses: time, position (m), quaternion x y z w
  camera.yaml             the camera, for --camera
  labels/                 11 (person) where an actor is seen, 255 (unknown) elsewhere
  instances/              which actor each pixel shows, 16 bit, from 1; 0 = none
  background.txt          time and colour image of each frame without people, as a path from the folder
  background_depth.txt    the same of its depth image, in the units of the sequence
  composition.json        who walks, and all options in effect)";

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
            << " % of the picture on average, " << fixed(100.0 * made.most(), 1) << " % at most\n";
  for (const auto& [reason, count] : made.skipped) std::cout << "skipped " << count << ": " << reason << "\n";
}

void warn(const ComposeArguments& arguments, const Composition& made) {
  if (arguments.options.actors > 0 && made.most() == 0.0) {
    std::cerr
        << "note: no actor is ever seen: whatever stands in the view is nearer; give a smaller --distance\n";
  }
  if (made.too_far > 0) {
    std::cerr << "note: " << made.too_far << " pixels are farther than "
              << fixed(65535.0 / arguments.settings.depth_units_per_metre, 1)
              << " m, for which there is no room in the depth images; a smaller --depth-units has it\n";
  }
}

void compose(ComposeArguments arguments) {
  const InterruptWatcher interrupt;
  arguments.options.min_distance = arguments.distance[0];
  arguments.options.max_distance = arguments.distance[1];
  const Eigen::Vector3d up(arguments.up[0], arguments.up[1], arguments.up[2]);
  if (!up.isZero(0.0)) arguments.options.up = up;
  arguments.options.validate();
  const Camera base = load_camera(arguments.camera);
  TumSource source(arguments.settings.folder, base);
  const Trajectory truth = read_truth(arguments.settings.folder);
  if (!arguments.options.up) arguments.options.up = find_up(arguments.settings.folder, base, truth);
  const Composer composer(base, read_people(arguments), truth, arguments.options);
  protect_base(arguments.settings);
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
    summary["out"] = arguments.settings.out.string();  // not in the file, which tells nothing of its place
    std::cout << summary.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    print_summary(arguments, made);
  }
  if (!made.times.empty()) warn(arguments, made);
  require_written_output();
}

void add_placement_options(CLI::App& command, ComposeArguments& arguments) {
  command.add_option("--distance", arguments.distance, "How far in front of the camera people walk, metres")
      ->type_name("MIN MAX")
      ->capture_default_str();
  command.add_option("--span", arguments.options.span, "How far they walk to each side, metres")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command
      .add_option("--camera-height", arguments.options.camera_height,
                  "Height of the camera above the floor, on average, metres")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str();
  command
      .add_option(
          "--up", arguments.up,
          "Which way is up in the world of groundtruth.txt, such as 0 0 1; default: where floors and tables "
          "face, or else what the camera's pictures have up")
      ->type_name("X Y Z");
}

}  // namespace

void add_compose_command(CLI::App& program) {
  const auto arguments = std::make_shared<ComposeArguments>();
  CLI::App* command = program.add_subcommand("compose", kHelp);
  command
      ->add_option("FOLDER", arguments->settings.folder,
                   "A TUM RGB-D folder without people, with groundtruth.txt")
      ->required();
  command
      ->add_option("--camera", arguments->camera,
                   "Its camera: tum-fr1 tum-fr2 tum-fr3 7scenes d435 d455 simulated, or a YAML file")
      ->required();
  command->add_option("--people", arguments->people, "Folder of pictures of people, each with its mask")
      ->required();
  command->add_option("--out", arguments->settings.out, "Folder to write to; made where it is missing")
      ->required();
  command->add_option("--actors", arguments->options.actors, "How many people; 0 copies the sequence")
      ->check(CLI::Range(0, 100))
      ->capture_default_str();
  command->add_option("--seed", arguments->options.seed, "Another number makes other people walk otherwise")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  add_placement_options(*command, *arguments);
  command->add_option("--frames", arguments->settings.frames, "How many frames to write; default all")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--depth-units", arguments->settings.depth_units_per_metre,
                   "Units a metre of the depth images; 1000 for what is farther than 13 m")
      ->check(CLI::Range(1.0, 100000.0))
      ->capture_default_str();
  command->add_flag("--quiet", arguments->settings.quiet, "No progress");
  command->add_flag("--json", arguments->json, "Print the summary as one JSON object");
  command->callback([arguments] { compose(*arguments); });
}

}  // namespace roslam::app
