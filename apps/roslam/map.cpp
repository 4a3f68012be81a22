// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/roslam/commands.hpp"
#include "apps/roslam/export_dense.hpp"
#include "apps/roslam/output.hpp"
#include "apps/roslam/progress.hpp"
#include "apps/roslam/sources.hpp"
#include "roslam/atlas/map_file.hpp"
#include "roslam/atlas/merge_maps.hpp"
#include "roslam/error.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/map/map_ply.hpp"
#include "roslam/pipeline/options.hpp"
#include "roslam/write_file.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The world with most keyframes.
WorldId main_world(const Map& map) {
  std::map<WorldId, std::size_t> sizes;
  for (const KeyframeId id : map.keyframe_ids()) ++sizes[map.find(id)->world];
  const auto largest = std::max_element(sizes.begin(), sizes.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  return largest != sizes.end() ? largest->first : WorldId{0};
}

// Metres along x, y and z within which the landmarks of the main world lie, but for the farthest hundredths.
Eigen::Vector3d extent(const Map& map) {
  const WorldId world = main_world(map);
  std::array<std::vector<double>, 3> coordinates;
  for (const LandmarkId id : map.landmark_ids()) {
    const Landmark& landmark = *map.find(id);
    if (map.world_of(landmark) != world) continue;
    for (int axis = 0; axis < 3; ++axis)
      coordinates[static_cast<std::size_t>(axis)].push_back(landmark.position[axis]);
  }
  Eigen::Vector3d result = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    auto& values = coordinates[static_cast<std::size_t>(axis)];
    if (values.empty()) continue;
    std::sort(values.begin(), values.end());
    const std::size_t tail = values.size() / 100;
    result[axis] = values[values.size() - 1 - tail] - values[tail];
  }
  return result;
}

std::string words_of(const SavedMap& saved) {
  if (saved.vocabulary == 0) return "none; made when the map is used";
  const fs::path shipped = shipped_vocabulary();
  const bool is_shipped = !shipped.empty() && Vocabulary::load(shipped).fingerprint() == saved.vocabulary;
  return is_shipped ? "of the vocabulary that comes with the program"
                    : "of another vocabulary; made anew when the map is used";
}

Json describe(const fs::path& file, const SavedMap& saved) {
  const Camera& camera = saved.camera;
  const Map& map = saved.map;
  const Eigen::Vector3d size = extent(map);
  return {{"file", file.string()},
          {"bytes", fs::file_size(file)},
          {"camera",
           {{"width", camera.width},
            {"height", camera.height},
            {"fx", camera.fx},
            {"fy", camera.fy},
            {"cx", camera.cx},
            {"cy", camera.cy},
            {"distortion", camera.distortion}}},
          {"keyframes", map.keyframe_count()},
          {"landmarks", map.landmark_count()},
          {"loops", map.loops().size()},
          {"flights", map.keyframe_count() > 0 ? map.flight() + 1 : 0},
          {"worlds", map.worlds().size()},
          {"extent_metres", {size.x(), size.y(), size.z()}},
          {"words", words_of(saved)}};
}

struct InfoArguments {
  fs::path file;
  bool json = false;
};

void show_info(const InfoArguments& arguments) {
  const Json info = describe(arguments.file, load_map(arguments.file));
  if (arguments.json) {
    std::cout << info.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    const Json& camera = info["camera"];
    const Json& size = info["extent_metres"];
    std::printf("camera: %d x %d, fx %g, fy %g, cx %g, cy %g\n", camera["width"].get<int>(),
                camera["height"].get<int>(), camera["fx"].get<double>(), camera["fy"].get<double>(),
                camera["cx"].get<double>(), camera["cy"].get<double>());
    std::printf("keyframes: %zu, flights: %zu\nlandmarks: %zu, within %.1f x %.1f x %.1f m\n",
                info["keyframes"].get<std::size_t>(), info["flights"].get<std::size_t>(),
                info["landmarks"].get<std::size_t>(), size[0].get<double>(), size[1].get<double>(),
                size[2].get<double>());
    std::printf("loops: %zu\n", info["loops"].get<std::size_t>());
    if (const auto worlds = info["worlds"].get<std::size_t>(); worlds > 1)
      std::printf("parts that never met: %zu\n", worlds);
    std::printf("words: %s\nsize: %.1f MB\n", info["words"].get<std::string>().c_str(),
                info["bytes"].get<double>() / 1048576.0);
  }
  require_written_output();
}

void add_info_command(CLI::App& map) {
  const auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command = map.add_subcommand("info", "Say what a map holds");
  command->footer("Example:\n  roslam map info live/map.roslam");
  command->add_option("MAP", arguments->file, "Map that roslam run wrote")->required();
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->callback([arguments] { show_info(*arguments); });
}

struct MergeArguments {
  std::vector<std::string> maps;
  fs::path out;
  std::string vocabulary;
  std::string config;
  bool quiet = false;
  bool json = false;
};

void merge(const MergeArguments& arguments) {
  const Options options = arguments.config.empty() ? Options{} : read_options(arguments.config);
  const auto vocabulary = load_vocabulary(arguments.vocabulary);
  if (vocabulary == nullptr) {
    throw InputError(
        "models/roslam-orb.vocabulary: not found beside the program; install it or name it with "
        "--vocabulary");
  }
  std::vector<SavedMap> maps;  // all of them first: an error at the end would cost the work until then
  for (const auto& file : arguments.maps) maps.push_back(load_map(file));
  SavedMap merged = std::move(maps.front());
  for (std::size_t i = 1; i < maps.size(); ++i) {
    const SavedMap& next = maps[i];
    Progress progress(next.map.keyframe_count(), arguments.quiet || arguments.json);
    merged = merge_maps(merged, next, vocabulary, options.loop_settings(),
                        [&](std::size_t done) { progress.show(done, "keyframes searched for"); });
  }
  save_map(arguments.out, merged);
  const Map& map = merged.map;
  if (arguments.json) {
    std::cout << describe(arguments.out, merged).dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    std::printf("map: %zu keyframes, %zu landmarks, %zu loops\nresults: %s\n", map.keyframe_count(),
                map.landmark_count(), map.loops().size(), arguments.out.c_str());
  }
  require_written_output();
}

void add_merge_command(CLI::App& map) {
  const auto arguments = std::make_shared<MergeArguments>();
  CLI::App* command = map.add_subcommand("merge", "Make one map of several that overlap");
  command->footer(
      "Example:\n"
      "  roslam map merge monday/map.roslam tuesday/map.roslam --out street.roslam\n"
      "Coordinates are those of the first. Maps that show no place in common are refused.");
  command->add_option("MAPS", arguments->maps, "Two maps or more, of one camera")
      ->required()
      ->expected(2, 1000);
  command->add_option("--out", arguments->out, "File the merged map is written to")->required();
  command->add_option("--vocabulary", arguments->vocabulary,
                      "Words that places are recognised by, in place of those that come with the program");
  command->add_option("--config", arguments->config, "YAML file with options, as of roslam run");
  command->add_flag("--quiet", arguments->quiet, "No progress");
  command->add_flag("--json", arguments->json, "Print what the map holds as one JSON object");
  command->callback([arguments] { merge(*arguments); });
}

struct ExportArguments {
  fs::path map;
  fs::path keyframes;
  fs::path camera;
  std::optional<std::uint32_t> flight;
  DenseExport dense;  // its ply serves both kinds of maps

  bool is_of_flight() const { return !keyframes.empty() || !camera.empty() || flight; }
};

void export_sparse(const fs::path& file, const ExportArguments& arguments) {
  const SavedMap saved = load_map(file);
  const Map& map = saved.map;
  const WorldId world = main_world(map);
  if (!arguments.dense.ply.empty()) write_map_ply(arguments.dense.ply, map, world);
  if (!arguments.camera.empty()) write_file(arguments.camera, camera_to_yaml(saved.camera));
  if (!arguments.keyframes.empty()) {
    const std::uint32_t flight = arguments.flight.value_or(map.flight());
    const Trajectory trajectory = map.trajectory(flight, world);
    if (trajectory.empty()) {
      throw InputError(file.string() + ": no keyframe of flight " + std::to_string(flight) +
                       " in its largest part; choose another --flight, counted from 0 (roslam map info)");
    }
    write_trajectory(arguments.keyframes, trajectory);
  }
  require_written_output();
}

// Of a run folder, the map that has what is asked for.
fs::path map_file(const ExportArguments& arguments) {
  if (!fs::is_directory(arguments.map)) return arguments.map;
  if (arguments.is_of_flight()) return arguments.map / "map.roslam";
  const fs::path dense = arguments.map / "dense.ply";
  if (!fs::exists(dense)) {
    throw InputError(dense.string() +
                     ": no such file; give the folder of a run with a dense map, or its map.roslam for the "
                     "landmarks");
  }
  return dense;
}

void export_map(const ExportArguments& arguments) {
  const auto refuse = [](const char* why) { throw CLI::ValidationError("roslam map export", why); };
  const DenseExport& dense = arguments.dense;
  if (!dense.has_file() && arguments.keyframes.empty() && arguments.camera.empty())
    refuse("needs --ply, --mesh, --pcd, --octomap, --keyframes or --camera");
  if (dense.resolution && dense.octomap.empty()) refuse("--resolution needs --octomap");
  const fs::path file = map_file(arguments);
  if (is_dense_map(file)) {
    if (arguments.is_of_flight())
      refuse("--keyframes, --flight and --camera need a map.roslam, not a PLY file");
    export_dense(file, dense);
  } else {
    if (dense.is_of_dense_only()) {
      refuse(
          "--mesh, --pcd, --octomap, --resolution and --no-invented need a dense map, and none of "
          "--keyframes, --flight and --camera");
    }
    export_sparse(file, arguments);
  }
}

std::string octomap_ending(const std::string& file) {
  const fs::path ending = fs::path(file).extension();
  return ending == ".bt" || ending == ".ot" ? "" : file + " has to end in .bt or .ot";
}

constexpr auto kExportExamples = R"(Examples:
  roslam map export live/map.roslam --ply landmarks.ply --keyframes keyframes.txt --camera camera.yaml
  roslam map export live --mesh street.ply --pcd street.pcd
  roslam map export live/dense.ply --octomap street.bt --resolution 0.1 --no-invented

MAP is a map.roslam, a dense map (PLY), or the folder of a run, whose dense.ply is taken, or its map.roslam where
--keyframes or --camera is asked for. Of parts of a map.roslam that never met, the largest is written.
OctoMap files hold cells that are occupied, by the points of the map, and free, as dense.bt beside dense.ply (the PLY's name
with .bt) tells; without that file only occupied cells are known.
Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

void add_export_command(CLI::App& map) {
  const auto arguments = std::make_shared<ExportArguments>();
  DenseExport& dense = arguments->dense;
  CLI::App* command = map.add_subcommand("export", "Write what a map holds in formats of other programs");
  command->footer(kExportExamples);
  command->add_option("MAP", arguments->map, "Map that roslam run wrote, or the folder of a run")->required();
  command->add_option("--ply", dense.ply,
                      "Points with colour (binary PLY): of a dense map with normals, labels and provenance, "
                      "else landmarks");
  command->add_option("--mesh", dense.mesh, "The same of a dense map, with triangles (binary PLY)");
  command->add_option("--pcd", dense.pcd, "Points of a dense map (binary PCD)");
  command->add_option("--octomap", dense.octomap, "Occupancy by a dense map: .bt, or .ot with probabilities")
      ->check(octomap_ending);
  command
      ->add_option("--resolution", dense.resolution,
                   "Side of a cell of --octomap, metres; default that of dense.bt, else twice the spacing "
                   "of points, at least 0.05")
      ->check(CLI::Range(0.001, 10.0));
  command->add_flag("--no-invented", dense.no_invented, "Leave out points that nobody saw");
  command->add_option("--keyframes", arguments->keyframes, "Poses of a flight's keyframes (TUM format)");
  command->add_option("--flight", arguments->flight,
                      "Flight whose keyframes are written, from 0; default the newest");
  command->add_option("--camera", arguments->camera, "Calibration, a file for --camera of roslam run");
  command->callback([arguments] { export_map(*arguments); });
}
}  // namespace

void add_map_command(CLI::App& program) {
  CLI::App* map = program.add_subcommand("map", "Look into, merge or export maps that runs wrote");
  map->require_subcommand(1);
  add_info_command(*map);
  add_merge_command(*map);
  add_export_command(*map);
}

}  // namespace roslam::app
