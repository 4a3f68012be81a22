// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/roslam/commands.hpp"
#include "apps/roslam/flight.hpp"
#include "apps/roslam/interrupt.hpp"
#include "apps/roslam/output.hpp"

namespace roslam::app {

namespace {
struct RunArguments {
  FlightArguments flight;
  bool print_config = false;
  bool json = false;
};

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

void print_dense(const DenseMap& dense) {
  std::printf("dense map: %zu points, voxels of %g m, %zu keyframes", dense.surface.points.size(),
              dense.voxel_size, dense.keyframes);
  if (dense.dropped > 0) std::printf(", %zu dropped", dense.dropped);
  std::printf("\n");
  if (dense.surface.points.empty())
    std::printf("note: the dense map is empty: %s\n", std::string(why_empty(dense)).c_str());
  if (dense.times_coarsened > 0)
    std::printf("note: voxels were made %d times as large, for the map to keep within dense.max_memory\n",
                1 << dense.times_coarsened);
  for (const auto& [fault, count] : dense.faults)
    std::printf("note: not in the dense map: %s (%zu times)\n", fault.c_str(), count);
}

void print_restoration(const Flight& flight) {
  std::printf("restored: %zu keyframes, %zu dropped\n", flight.restored, flight.slam->unrestored());
  for (const auto& [fault, count] : flight.slam->restoration_faults())
    std::printf("note: not restored: %s (%zu times)\n", fault.c_str(), count);
}

void print_summary(const Slam& slam, const RunSummary& summary, const std::string& folder, bool has_map) {
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
  if (summary.dense) print_dense(*summary.dense);
  if (const auto found = times.find("tracking"); found != times.end()) {
    std::printf("tracking: median %.1f ms, p95 %.1f ms of processor time a frame\n", found->second.median_ms,
                found->second.p95_ms);
  }
  std::printf("results: %s\n", folder.c_str());
}

void check(const FlightArguments& arguments, const Options& options) {
  if (arguments.source.name.empty()) throw CLI::RequiredError("SOURCE");
  if (arguments.out.empty()) throw CLI::RequiredError("--out");
  if (!arguments.model.empty() && !options.removal.labels) {
    throw CLI::ValidationError("--model", "needs --dynamic labels or both");
  }
  if (!arguments.vocabulary.empty() && !options.loop.enabled) {
    throw CLI::ValidationError("--vocabulary", "needs loop.enabled");
  }
  const bool restores = (arguments.restore || (options.dense.enabled && options.dense.restore)) &&
                        options.removal.is_on() && options.keyframes.enabled;
  if (!arguments.models.empty() && !restores)
    throw CLI::ValidationError(
        "--models", "needs keyframes that are restored: --restore or a dense map, and what moves removed");
  if (arguments.restore && !options.keyframes.enabled)
    throw CLI::ValidationError("--restore", "restores keyframes, of which --localise-only makes none");
  if (arguments.restore && !options.removal.is_on())
    throw CLI::ValidationError("--restore", "has nothing to restore with --dynamic none");
  if (!options.keyframes.enabled && arguments.map.empty()) {
    throw CLI::ValidationError("--localise-only", "needs --map, a map to find the camera in");
  }
}

void execute(RunArguments arguments, const std::string& version) {
  const Options options = options_of(arguments.flight);
  if (arguments.print_config) {
    std::cout << options_to_yaml(options);
    require_written_output();
    return;
  }
  check(arguments.flight, options);
  const InterruptWatcher interrupt;
  arguments.flight.quiet |= arguments.json;
  const Flight flight = fly(arguments.flight, options, version, interrupt.token());
  if (arguments.json) {
    const auto report = run_report(*flight.slam, flight.summary, *flight.source, flight.description);
    std::cout << nlohmann::json::parse(report).dump() << "\n";
  } else {
    if (arguments.flight.restore) print_restoration(flight);
    print_summary(*flight.slam, flight.summary, arguments.flight.out, !arguments.flight.map.empty());
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
      "RUN then holds report.html to look at, trajectory.txt and keyframes.txt (TUM format), dense.ply and "
      "dense.bt\n"
      "(the dense map), map.ply, map.roslam, trajectory.png and run.json.\n"
      "Ctrl-C ends the run early and writes what was computed so far (exit code 0, \"interrupted\" in "
      "run.json).");
  add_source_options(*command, arguments->flight.source);
  command->add_option("--out", arguments->flight.out,
                      "Folder the results are written to; made if it does not exist");
  command->add_option("--config", arguments->flight.config,
                      "YAML file with options; --print-config shows them all");
  auto* deterministic =
      command->add_flag("--deterministic", arguments->flight.deterministic,
                        "One stage after the other: the same input gives the same bytes (default)");
  command
      ->add_flag(
          "--real-time", arguments->flight.real_time,
          "Stages on threads, frames at the pace of their timestamps; late frames are dropped and counted")
      ->excludes(deterministic);
  command
      ->add_option(
          "--dynamic", arguments->flight.dynamic,
          "How what moves is found and removed: none, labels (a network's persons, cars, bicycles), geometry "
          "(depth and optical flow) or both; default both, or as --config says. For comparison: "
          "ds-slam-like, "
          "dynaslam-like")
      ->check(CLI::IsMember(removal_modes()));
  command->add_option(
      "--model", arguments->flight.model,
      "Weights of the network that labels (ONNX), in place of those that come with the program");
  command->add_option("--vocabulary", arguments->flight.vocabulary,
                      "Words that places are recognised by, in place of those that come with the program");
  command->add_flag(
      "--no-loops", arguments->flight.no_loops,
      "Recognise no places by their words and close no loops; the path is then as odometry has it");
  command->add_option("--map", arguments->flight.map,
                      "Go on from the map of an earlier flight with this camera (map.roslam of its folder)");
  command->add_flag("--localise-only", arguments->flight.localise_only,
                    "Find the camera in --map and leave the map as it is");
  add_flight_options(*command, arguments->flight.source);
  command->add_flag("--print-config", arguments->print_config, "Print the effective options and stop");
  command->add_flag("--video", arguments->flight.video,
                    "Write removal.avi too: each frame with what was kept and what was removed");
  command->add_flag("--no-dense", arguments->flight.no_dense,
                    "Make no dense map, and restore no keyframes for it");
  command->add_flag(
      "--restore", arguments->flight.restore,
      "Write the keyframes as they go into the dense map to RUN/restored: what the removal leaves open is "
      "filled from those before and by a network; roslam restore does more, afterwards, with all frames");
  command->add_option(
      "--models", arguments->flight.models,
      "Folder of the networks that paint what nobody saw, in place of those that come with the program");
  command->add_flag("--quiet", arguments->flight.quiet, "No progress");
  command->add_flag("--json", arguments->json, "Print the report as one JSON object");
  command->callback([arguments, version] { execute(*arguments, version); });
}

}  // namespace roslam::app
