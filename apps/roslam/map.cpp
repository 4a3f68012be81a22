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

#include "apps/roslam/export/export_dense.hpp"
#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/named_path.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/progress.hpp"
#include "apps/roslam/support/replaces_only.hpp"
#include "apps/roslam/support/sources.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/geometry/trajectory.hpp"
#include "roslam/map/map_ply.hpp"
#include "roslam/map_io/map_file.hpp"
#include "roslam/map_io/merge_maps.hpp"
#include "roslam/options/options.hpp"
#include "roslam/options/settings.hpp"
#include "roslam/place_recognition/vocabulary.hpp"

namespace roslam::app {

using namespace simulation;

namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// The submap with most keyframes.
SubmapId main_submap(const Map& map) {
  std::map<SubmapId, std::size_t> sizes;
  for (const KeyframeId id : map.keyframe_ids()) ++sizes[map.find(id)->submap];
  const auto largest = std::max_element(sizes.begin(), sizes.end(),
                                        [](const auto& a, const auto& b) { return a.second < b.second; });
  return largest != sizes.end() ? largest->first : SubmapId{0};
}

// Extent of the landmarks of the main submap along x, y and z in metres, from the 1st to the 99th percentile.
Eigen::Vector3d extent(const Map& map) {
  const SubmapId submap = main_submap(map);
  std::array<std::vector<double>, 3> coordinates;
  for (const LandmarkId id : map.landmark_ids()) {
    const Landmark& landmark = *map.find(id);
    if (map.submap_of(landmark) != submap) continue;
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

std::string vocabulary_of(const SavedMap& saved) {
  if (saved.vocabulary == 0) return "none; computed when the map is used";
  const fs::path shipped = find_vocabulary();
  const bool is_shipped = !shipped.empty() && Vocabulary::load(shipped).fingerprint() == saved.vocabulary;
  return is_shipped ? "of the shipped vocabulary" : "of another vocabulary; recomputed when the map is used";
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
            {"model", lens_model_name(camera.model)},
            {"distortion", camera.coefficients()}}},
          {"keyframes", map.keyframe_count()},
          {"landmarks", map.landmark_count()},
          {"loops", map.loops().size()},
          {"sessions", map.keyframe_count() > 0 ? map.session() + 1 : 0},
          {"submaps", map.submaps().size()},
          {"extent_metres", {size.x(), size.y(), size.z()}},
          {"words", vocabulary_of(saved)}};
}

struct InfoArguments {
  fs::path file;
  bool json = false;
};

void show_info(const InfoArguments& arguments) {
  const fs::path file = map_file(arguments.file);
  const Json info = describe(file, load_map(file));
  if (arguments.json) {
    std::cout << info.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    const Json& camera = info["camera"];
    const Json& size = info["extent_metres"];
    std::printf("camera: %d x %d, fx %g, fy %g, cx %g, cy %g\n", camera["width"].get<int>(),
                camera["height"].get<int>(), camera["fx"].get<double>(), camera["fy"].get<double>(),
                camera["cx"].get<double>(), camera["cy"].get<double>());
    std::printf("keyframes: %zu, sessions: %zu\nlandmarks: %zu, within %.1f x %.1f x %.1f m\n",
                info["keyframes"].get<std::size_t>(), info["sessions"].get<std::size_t>(),
                info["landmarks"].get<std::size_t>(), size[0].get<double>(), size[1].get<double>(),
                size[2].get<double>());
    std::printf("loops: %zu\n", info["loops"].get<std::size_t>());
    if (const auto submaps = info["submaps"].get<std::size_t>(); submaps > 1)
      std::printf("submaps that were never merged: %zu\n", submaps);
    std::printf("words: %s\nsize: %.1f MB\n", info["words"].get<std::string>().c_str(),
                info["bytes"].get<double>() / 1048576.0);
  }
  require_written_output();
}

void add_map_info_command(CLI::App& map) {
  const auto arguments = std::make_shared<InfoArguments>();
  CLI::App* command = map.add_subcommand("info", "Print the contents of a map");
  command->footer(
      "Example:\n"
      "  roslam map info live\n"
      "Prints the camera, the numbers of keyframes, landmarks, loops, sessions (runs that made the map) and\n"
      "submaps (parts not connected with each other), the extent in metres and the size of the file.\n"
      "Exit code: 0 success, 1 an error in the input, 2 wrong usage.");
  command->add_option("MAP", arguments->file, "Map file (map.roslam), or folder of the run that wrote it")
      ->required();
  command->add_flag("--json", arguments->json, "Print one JSON object on stdout");
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
  const auto vocabulary = open_vocabulary(arguments.vocabulary);
  if (vocabulary == nullptr) {
    throw InputError(
        "models/roslam-orb.vocabulary: not found beside the program; install it or name it with "
        "--vocabulary");
  }
  std::vector<SavedMap> maps;  // all of them first: an error at the end would waste the merges before it
  for (const auto& file : arguments.maps) maps.push_back(load_map(map_file(file)));
  SavedMap merged = std::move(maps.front());
  for (std::size_t i = 1; i < maps.size(); ++i) {
    const SavedMap& next = maps[i];
    Progress progress(next.map.keyframe_count(), arguments.quiet || arguments.json);
    merged = merge_maps(merged, next, vocabulary, loop_settings(options),
                        [&](std::size_t done) { progress.show(done, "keyframes queried"); });
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
  CLI::App* command = map.add_subcommand("merge", "Merge maps that overlap into one");
  command->footer(
      "Example:\n"
      "  roslam map merge monday/map.roslam tuesday/map.roslam --out street.roslam\n"
      "Place recognition aligns each map with the merged ones; coordinates are those of the first. A map\n"
      "in which no keyframe of the others is recognised is refused, as is one that the others contain, such\n"
      "as a map and its continuation by --map. Keyframes that both hold are inserted once.\n"
      "Exit code: 0 success, 1 an error in the input, 2 wrong usage.");
  command
      ->add_option("MAPS", arguments->maps,
                   "Two or more maps of the same camera: map files (map.roslam) or folders of runs")
      ->required()
      ->expected(2, 1000);
  command->add_option("--out", arguments->out, "File the merged map is written to")
      ->required()
      ->check(ReplacesOnly({"ROSLAMMP"}));
  command->add_option("--vocabulary", arguments->vocabulary,
                      "Vocabulary for place recognition (roslam vocabulary train); default the shipped one");
  command->add_option("--config", arguments->config, "YAML file with options, as for roslam run");
  command->add_flag("--quiet", arguments->quiet, "Print no progress");
  command->add_flag("--json", arguments->json,
                    "Print the contents of the merged map as one JSON object on stdout");
  command->callback([arguments] { merge(*arguments); });
}

struct ExportArguments {
  fs::path map;
  fs::path keyframes;
  fs::path camera;
  std::optional<std::uint32_t> session;
  DenseExport dense;  // its ply serves both kinds of maps

  // Whether it asks for something that only a map.roslam has.
  bool needs_sparse_map() const { return !keyframes.empty() || !camera.empty() || session; }
};

void export_sparse(const fs::path& file, const ExportArguments& arguments) {
  const SavedMap saved = load_map(file);
  const Map& map = saved.map;
  const SubmapId submap = main_submap(map);
  if (!arguments.dense.ply.empty()) write_map_ply(arguments.dense.ply, map, submap);
  if (!arguments.camera.empty()) write_file(arguments.camera, camera_to_yaml(saved.camera));
  if (!arguments.keyframes.empty()) {
    const std::uint32_t session = arguments.session.value_or(map.session());
    const Trajectory trajectory = map.trajectory(session, submap);
    if (trajectory.empty()) {
      throw InputError(file.string() + ": no keyframe of session " + std::to_string(session) +
                       " in its largest submap; choose another --session, counted from 0 (roslam map info)");
    }
    write_trajectory(arguments.keyframes, trajectory);
  }
  require_written_output();
}

// The map file to read; of a run folder the one that has what is asked for.
fs::path exported_file(const ExportArguments& arguments) {
  if (!fs::is_directory(arguments.map)) return arguments.map;
  if (arguments.needs_sparse_map()) return map_file(arguments.map);
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
  // Options that contradict each other are refused below, whatever the folder holds.
  const bool contradicts = arguments.needs_sparse_map() && dense.is_of_dense_only();
  const fs::path file = contradicts ? arguments.map : exported_file(arguments);
  if (is_dense_map(file)) {
    if (arguments.needs_sparse_map())
      refuse("--keyframes, --session and --camera need a map.roslam, not a PLY file");
    export_dense(file, dense);
  } else {
    if (dense.is_of_dense_only()) {
      refuse(
          "--mesh, --pcd, --octomap, --resolution and --no-inpainted need a dense map, and none of "
          "--keyframes, --session and --camera");
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
  roslam map export live/dense.ply --octomap street.bt --resolution 0.1 --no-inpainted

MAP is a map.roslam, a dense map (PLY), or the folder of a run: then its map.roslam is read if --keyframes,
--session or --camera is given, else its dense.ply. Of a map.roslam with several submaps the largest is
written.
Occupied cells of an OctoMap come from the points of the dense map, free cells from dense.bt beside dense.ply
(the name of the PLY with .bt); without that file only occupied cells are known.
Coordinates are those of the map, in metres.
Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

void add_map_export_command(CLI::App& map) {
  const auto arguments = std::make_shared<ExportArguments>();
  DenseExport& dense = arguments->dense;
  CLI::App* command = map.add_subcommand("export", "Export a map to PLY, PCD, OctoMap and TUM files");
  command->footer(kExportExamples);
  command->add_option("MAP", arguments->map, "map.roslam, dense map (PLY) or folder of a run")->required();
  command
      ->add_option("--ply", dense.ply,
                   "Write coloured points (binary PLY): of a dense map, with normals, labels and "
                   "provenance, else landmarks")
      ->check(ReplacesOnly({"ply"}));
  command->add_option("--mesh", dense.mesh, "Write points and triangles of a dense map (binary PLY)")
      ->check(ReplacesOnly({"ply"}));
  command->add_option("--pcd", dense.pcd, "Write points of a dense map (binary PCD)")
      ->check(ReplacesOnly({"# .PCD"}));
  command
      ->add_option("--octomap", dense.octomap,
                   "Write occupancy of a dense map: .bt (binary OctoMap) or .ot (with probabilities)")
      ->check(octomap_ending)
      ->check(ReplacesOnly({"# Octomap"}));
  command
      ->add_option("--resolution", dense.resolution,
                   "Cell size of --octomap, metres; default that of dense.bt, else twice the point spacing, "
                   "at least 0.05")
      ->check(CLI::Range(0.001, 10.0));
  command->add_flag("--no-inpainted,--no-invented", dense.no_inpainted, "Leave out inpainted points");
  command
      ->add_option("--keyframes", arguments->keyframes, "Write the keyframe poses of a session (TUM format)")
      ->check(ReplacesOnly({"# timestamp tx"}));
  command->add_option("--session,--flight", arguments->session,
                      "Session whose keyframes are written, counted from 0; default the newest");
  command->add_option("--camera", arguments->camera, "Write the camera parameters (YAML)")
      ->check(ReplacesOnly({"model:"}));
  command->callback([arguments] { export_map(*arguments); });
}
}  // namespace

void add_map_command(CLI::App& program) {
  CLI::App* map = program.add_subcommand("map", "Inspect, merge or export maps that roslam run wrote");
  map->require_subcommand(1);
  add_map_info_command(*map);
  add_merge_command(*map);
  add_map_export_command(*map);
}

}  // namespace roslam::app
