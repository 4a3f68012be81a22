// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/roslam/commands.hpp"
#include "apps/roslam/interrupt.hpp"
#include "apps/roslam/output.hpp"
#include "apps/roslam/progress.hpp"
#include "apps/roslam/sources.hpp"
#include "roslam/atlas/map_file.hpp"
#include "roslam/error.hpp"
#include "roslam/pipeline/removal_log.hpp"
#include "roslam/pipeline/run.hpp"
#include "roslam/pipeline/run_folder.hpp"
#include "roslam/pipeline/slam.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"

namespace roslam::app {

namespace {
struct RunArguments {
  SourceArguments source;
  std::string out;
  std::string config;
  bool deterministic = false;
  bool real_time = false;
  std::string model;       // weights in place of the shipped ones
  std::string vocabulary;  // words in place of the shipped ones
  bool no_loops = false;
  std::string map;  // to go on from; empty: none
  bool localise_only = false;
  std::string dynamic;  // empty: as the options say
  bool print_config = false;
  bool video = false;
  bool quiet = false;
  bool json = false;
};

// A run without a single pose is no success, whatever was written.
void require_poses(const Slam& slam, const RunSummary& summary, const FrameSource& source,
                   const std::string& name) {
  if (summary.interrupted || !slam.trajectory().empty()) return;
  const std::string skipped = in_words(source.skipped()) + in_words(slam.rejected());
  if (slam.frames() == 0) {
    throw InputError(name + ": no frame could be used" + skipped + "; check the images and --camera");
  }
  if (const bool localises = !slam.options().keyframes.enabled; localises || slam.map().flight() > 0) {
    throw InputError(name + ": no frame was recognised in the map" + skipped +
                     "; fly where the map was made, or leave out " +
                     (localises ? "--localise-only" : "--map"));
  }
  const std::string reasons = skipped + in_words(source.skipped_depth());
  if (summary.without_depth == slam.frames()) {
    throw InputError(name + ": no frame could be tracked, none has depth" + reasons +
                     "; RGB-D tracking needs depth images, 16 bit, within 20 ms of the colour images");
  }
  throw InputError(name + ": no frame could be tracked" + reasons + "; tracking starts at an image with " +
                   std::to_string(slam.options().tracker.min_initial_points) +
                   " corners of known depth: check the images and depth_units_per_metre of the camera");
}

// The network that finds what may move; null where nothing is to be removed. Without its weights a flight is
// still worth tracking.
std::shared_ptr<Segmenter> open_segmenter(const RunArguments& arguments, Options& options,
                                          std::string& model) {
  if (!options.removal.labels) return nullptr;
  const std::filesystem::path file =
      arguments.model.empty() ? shipped_segmentation_model() : std::filesystem::path(arguments.model);
  if (file.empty()) {
    options.removal.labels = false;
    std::cerr << "note: " << missing_segmentation_model().what()
              << (options.removal.is_on() ? "; what moves is found by geometry alone\n"
                                          : "; points on things that move are not removed\n");
    return nullptr;
  }
  model = file.string();
  return std::make_shared<PspnetSegmenter>(file, options.segmenter);
}

// The words that places are recognised by; null where no loop is to be closed. Without them a flight is still
// worth tracking.
std::shared_ptr<const Vocabulary> open_vocabulary(const RunArguments& arguments, Options& options) {
  if (!options.loop.enabled) return nullptr;
  if (auto vocabulary = load_vocabulary(arguments.vocabulary)) return vocabulary;
  options.loop.enabled = false;
  std::cerr << "note: models/roslam-orb.vocabulary: not found beside the program; no loop is closed. Install "
               "it or name it with --vocabulary\n";
  return nullptr;
}

std::optional<SavedMap> open_map(const RunArguments& arguments) {
  if (arguments.map.empty()) return std::nullopt;
  return load_map(arguments.map);
}

void print_map(const Slam& slam, bool has_map) {
  if (has_map && !slam.has_met_map()) {
    std::printf("note: no place of the map was seen again; poses are in coordinates of their own\n");
  }
  for (const auto& loop : slam.loops()) {
    std::printf(
        "loop: keyframe %u showed the place of keyframe %u again; it moved by %.3f m, %.2f degrees%s\n",
        loop.keyframe.value, loop.place.value, loop.moved, loop.turned * 180.0 / M_PI,
        loop.joins ? ", and two parts of the map became one" : "");
  }
  for (const auto& [world, frames] : slam.frames_apart()) {
    std::printf(
        "note: %zu frames lie in a part of the map that never met the rest; trajectory.txt leaves them "
        "out\n",
        frames);
  }
  std::printf("map: %zu keyframes, %zu landmarks\n", slam.map().keyframe_count(),
              slam.map().landmark_count());
}

void print_summary(const Slam& slam, const RunSummary& summary, const RunFolder& folder, bool has_map) {
  const auto times = slam.times().summary();
  const std::size_t tracked = slam.trajectory().size();
  std::printf(
      "tracked %zu of %zu frames (%.1f %%), %zu dropped%s\n", tracked, slam.frames(),
      100.0 * static_cast<double>(tracked) / static_cast<double>(std::max<std::size_t>(slam.frames(), 1)),
      summary.dropped, summary.interrupted ? ", interrupted" : "");
  if (summary.removal && summary.removal->frames > 0) {
    const RemovalTally& tally = *summary.removal;
    std::printf("removed: %.1f %% of the picture on average",
                100.0 * tally.removed_area / static_cast<double>(tally.frames));
    if (tally.predicted > 0) std::printf("; %zu frames predicted while it was hidden", tally.predicted);
    std::printf("\n");
  }
  for (const auto& [fault, count] : slam.labelling_faults()) {
    std::printf("note: %s (%zu times)\n", fault.c_str(), count);
  }
  print_map(slam, has_map);
  if (const auto found = times.find("tracking"); found != times.end()) {
    std::printf("tracking: median %.1f ms, p95 %.1f ms of processor time a frame\n", found->second.median_ms,
                found->second.p95_ms);
  }
  std::printf("results: %s\n", folder.path().c_str());
}

Options options_of(const RunArguments& arguments) {
  Options options = arguments.config.empty() ? Options{} : read_options(arguments.config);
  if (!arguments.dynamic.empty()) options.removal = *removal_from(arguments.dynamic, options.removal);
  if (arguments.no_loops) options.loop.enabled = false;
  if (arguments.localise_only) options.keyframes.enabled = false;
  return options;
}

void check(const RunArguments& arguments, const Options& options) {
  if (arguments.source.name.empty()) throw CLI::RequiredError("SOURCE");
  if (arguments.out.empty()) throw CLI::RequiredError("--out");
  if (!arguments.model.empty() && !options.removal.labels) {
    throw CLI::ValidationError("--model", "needs --dynamic labels or both");
  }
  if (!arguments.vocabulary.empty() && !options.loop.enabled) {
    throw CLI::ValidationError("--vocabulary", "needs loop.enabled");
  }
  if (!options.keyframes.enabled && arguments.map.empty()) {
    throw CLI::ValidationError("--localise-only", "needs --map, a map to find the camera in");
  }
}

void execute(const RunArguments& arguments, const std::string& version) {
  Options options = options_of(arguments);
  if (arguments.print_config) {
    std::cout << options_to_yaml(options);
    require_written_output();
    return;
  }
  check(arguments, options);
  const InterruptWatcher interrupt;
  const auto source = open_source(arguments.source);
  auto map = open_map(arguments);
  const RunFolder folder(arguments.out);
  RunDescription description{arguments.source.name, arguments.source.camera, version, {}, arguments.map};
  const auto segmenter = open_segmenter(arguments, options, description.segmentation_model);
  Slam slam(source->camera(), options, arguments.real_time ? Mode::kRealTime : Mode::kDeterministic,
            segmenter, open_vocabulary(arguments, options));
  if (map) slam.continue_from(std::move(*map));
  std::optional<RemovalLog> log;
  RemovalLog::remove_old(folder.path());
  if (options.removal.is_on()) {
    log.emplace(RemovalLog::Settings{folder.path(), slam.mode(), source->camera().fps, arguments.video});
  }
  RunSummary summary;
  {
    Progress progress(source->size(), arguments.quiet || arguments.json);
    summary = run(
        *source, slam,
        [&](const Frame& frame, const FrameResult& result) {
          if (log) log->add(frame, result);
          progress.show(result.index + 1, name_of(result.state));
        },
        interrupt.token());
  }
  std::exception_ptr log_failure;
  try {
    if (log) log->finish();
  } catch (...) {
    log_failure = std::current_exception();
  }
  if (log) summary.removal = log->tally();
  folder.write(slam, summary, *source, description);
  if (log_failure) std::rethrow_exception(log_failure);
  if (summary.failure) std::rethrow_exception(summary.failure);
  require_poses(slam, summary, *source, arguments.source.name);
  if (arguments.json) {
    std::cout << nlohmann::json::parse(run_report(slam, summary, *source, description)).dump() << "\n";
  } else {
    print_summary(slam, summary, folder, !arguments.map.empty());
  }
  require_written_output();
}
}  // namespace

void add_run_command(CLI::App& program, const std::string& version) {
  const auto arguments = std::make_shared<RunArguments>();
  CLI::App* command =
      program.add_subcommand("run", "Track a recorded or simulated flight and map what it sees");
  command->footer(
      "Examples:\n"
      "  roslam run simulated:street --out street\n"
      "  roslam run rgbd_dataset_freiburg1_rpy --camera tum-fr1 --out rpy\n"
      "  roslam run my_flight --camera my_camera.yaml --real-time --out live\n"
      "  roslam run another_flight --map live/map.roslam --out further\n"
      "RUN then holds trajectory.txt and keyframes.txt (TUM format), map.ply, map.roslam, trajectory.png and "
      "run.json.\n"
      "Ctrl-C ends the run early and writes what was computed so far (exit code 0, \"interrupted\" in "
      "run.json).");
  add_source_options(*command, arguments->source);
  command->add_option("--out", arguments->out,
                      "Folder the results are written to; made if it does not exist");
  command->add_option("--config", arguments->config, "YAML file with options; --print-config shows them all");
  auto* deterministic =
      command->add_flag("--deterministic", arguments->deterministic,
                        "One stage after the other: the same input gives the same bytes (default)");
  command
      ->add_flag(
          "--real-time", arguments->real_time,
          "Stages on threads, frames at the pace of their timestamps; late frames are dropped and counted")
      ->excludes(deterministic);
  command
      ->add_option(
          "--dynamic", arguments->dynamic,
          "How what moves is found and removed: none, labels (a network's persons, cars, bicycles), geometry "
          "(depth and optical flow) or both; default both, or as --config says. For comparison: "
          "ds-slam-like, "
          "dynaslam-like")
      ->check(CLI::IsMember(removal_modes()));
  command->add_option(
      "--model", arguments->model,
      "Weights of the network that labels (ONNX), in place of those that come with the program");
  command->add_option("--vocabulary", arguments->vocabulary,
                      "Words that places are recognised by, in place of those that come with the program");
  command->add_flag(
      "--no-loops", arguments->no_loops,
      "Recognise no places by their words and close no loops; the path is then as odometry has it");
  command->add_option("--map", arguments->map,
                      "Go on from the map of an earlier flight with this camera (map.roslam of its folder)");
  command->add_flag("--localise-only", arguments->localise_only,
                    "Find the camera in --map and leave the map as it is");
  add_flight_options(*command, arguments->source);
  command->add_flag("--print-config", arguments->print_config, "Print the effective options and stop");
  command->add_flag("--video", arguments->video,
                    "Write removal.avi too: each frame with what was kept and what was removed");
  command->add_flag("--quiet", arguments->quiet, "No progress");
  command->add_flag("--json", arguments->json, "Print the report as one JSON object");
  command->callback([arguments, version] { execute(*arguments, version); });
}

}  // namespace roslam::app
