// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/roslam/run/flight.hpp"
#include "apps/roslam/run/run_summary.hpp"
#include "apps/roslam/support/backend_option.hpp"
#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/live_camera.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/replaces_only.hpp"
#include "roslam/common/error.hpp"

namespace roslam::app {

using namespace recording;

namespace {
struct RunArguments {
  FlightArguments flight;
  std::string resume;
  bool print_config = false;
  bool json = false;
  bool strict = false;
};

void check(const FlightArguments& arguments, const Options& options) {
  if (arguments.source.name.empty()) throw CLI::RequiredError("SOURCE");
  if (arguments.out.empty()) throw CLI::RequiredError("--out");
  if (!arguments.model.empty() && !options.dynamic_objects.labels) {
    throw CLI::ValidationError("--model", "needs --dynamic labels or both");
  }
  if (!arguments.vocabulary.empty() && !options.loop.enabled) {
    throw CLI::ValidationError("--vocabulary", "needs loop.enabled");
  }
  const bool restores = (arguments.restore || (options.dense.enabled && options.dense.restore)) &&
                        options.dynamic_objects.is_on() && options.keyframes.enabled;
  if (!arguments.models.empty() && !restores)
    throw CLI::ValidationError(
        "--models", "needs restored keyframes: --restore or a dense map, and --dynamic other than none");
  if (arguments.restore && !options.keyframes.enabled)
    throw CLI::ValidationError("--restore", "restores keyframes, and --localise-only creates none");
  if (arguments.restore && !options.dynamic_objects.is_on())
    throw CLI::ValidationError("--restore", "has nothing to restore with --dynamic none");
  if (!arguments.record.empty() && !is_live_camera(arguments.source.name))
    throw CLI::ValidationError("--record",
                               "records a camera (realsense); roslam record converts other sources");
  if (!options.keyframes.enabled && arguments.map.empty()) {
    throw CLI::ValidationError("--localise-only", "needs --map, the map to localise in");
  }
}

// Results are written by then: exit code 3 tells a script that they are not what it wanted.
void require_complete(const Flight& flight) {
  const FrameCounts counts = count_frames(*flight.slam, flight.summary, *flight.source);
  if (!counts.is_complete()) throw IncompleteRun("--strict: " + counts.in_words());
  if (const auto warnings = flight.slam->warnings(); !warnings.empty())
    throw IncompleteRun("--strict: " + warnings.begin()->first);
}

// A run that was killed before its first checkpoint has no map to go on from.
void resume(RunArguments& arguments) {
  if (arguments.resume.empty()) return;
  FlightArguments& flight = arguments.flight;
  if (!std::filesystem::is_directory(arguments.resume))
    throw InputError(arguments.resume + ": no folder of a run to resume; give one, or --out for a new run");
  flight.out = arguments.resume;
  flight.resume = true;
  const std::filesystem::path map = std::filesystem::path(arguments.resume) / "map.roslam";
  if (std::filesystem::exists(map)) {
    flight.map = map.string();
  } else {
    std::cerr << "note: " << map.string() << ": not there, so that a new map begins\n";
  }
}

void execute(RunArguments arguments, const std::string& version) {
  settle_imu(arguments.flight.source);
  resume(arguments);
  const Options options = options_of(arguments.flight);
  if (arguments.print_config) {
    std::cout << options_to_yaml(options);
    require_written_output();
    return;
  }
  check(arguments.flight, options);
  const InterruptWatcher interrupt(InterruptWatcher::kTwice);
  arguments.flight.quiet |= arguments.json;
  const Flight flight = fly(arguments.flight, options, version, interrupt.token(), interrupt.urgent_token());
  if (arguments.json) {
    const auto report = run_report(*flight.slam, flight.summary, *flight.source, flight.description);
    std::cout << nlohmann::json::parse(report).dump() << "\n";
  } else {
    if (arguments.flight.restore) print_restoration(flight);
    print_summary(flight, arguments.flight);
  }
  require_written_output();
  if (arguments.strict) require_complete(flight);
}
}  // namespace

void add_run_command(CLI::App& program, const std::string& version) {
  const auto arguments = std::make_shared<RunArguments>();
  CLI::App* command = program.add_subcommand(
      "run",
      "Track a camera that is connected, or of a recorded or simulated flight, and map the static scene");
  command->footer(
      "Examples:\n"
      "  roslam run simulated:street --out street\n"
      "  roslam run rgbd_dataset_freiburg1_rpy --camera tum-fr1 --out rpy\n"
      "  roslam run realsense --record flight.mcap --out flight\n"
      "  roslam run my_flight --camera my_camera.yaml --real-time --out live\n"
      "  roslam run another_flight --map live/map.roslam --out further\n"
      "Writes to the folder RUN of --out:\n"
      "  report.html trajectory.png   the run in figures and tables\n"
      "  trajectory.txt keyframes.txt camera poses of frames and keyframes (TUM format)\n"
      "  odometry.csv                 continuous pose and velocity of the drone, with covariances\n"
      "  groundtruth.txt              true poses, where the source has them (TUM format)\n"
      "  dense.ply dense.bt           dense map: points and triangles; free and occupied space (OctoMap)\n"
      "  map.ply map.roslam           landmarks; the map file for --map and roslam map\n"
      "  descriptors.jsonl masks/     dynamic objects of each frame and their masks\n"
      "  removal.jpg restoration.jpg  sample images: points removed; keyframes restored\n"
      "  run.json                     options, counts, processor times, memory\n"
      "Ctrl-C ends the run early and writes the results so far (\"interrupted\" in run.json). A second one "
      "leaves out\n"
      "the dense map, the report and images and ends the program within 0.2 s: what is not written by then "
      "stays\n"
      "as it was last saved during the run, which is less than a second ago for the trajectory.\n"
      "Results of an earlier run in RUN are moved to RUN/previous/.\n"
      "Exit code: 0 success, 1 an error in the input, 2 wrong usage, 3 with --strict: results are written, "
      "but not\n"
      "every frame of the source has a pose, or the input is doubtful (a WARNING).");
  add_source_options(*command, arguments->flight.source);
  add_stream_option(*command, arguments->flight.source);
  command
      ->add_option("--record", arguments->flight.record,
                   "MCAP file to which the camera is recorded meanwhile; roslam run FILE repeats the flight")
      ->check(ReplacesOnly({"\x89MCAP0\r\n"}));
  add_topic_options(*command, arguments->flight.source);
  add_mount_option(*command, arguments->flight.source);
  command->add_option("--out", arguments->flight.out,
                      "Folder the results are written to; made if it does not exist (required)");
  command->add_option("--config", arguments->flight.config,
                      "YAML file with options; --print-config prints all of them");
  auto* deterministic =
      command->add_flag("--deterministic", arguments->flight.deterministic,
                        "Run the stages one after the other: the same input gives the same bytes (default)");
  command
      ->add_flag("--real-time", arguments->flight.real_time,
                 "Run the stages in parallel, read frames at the pace of their timestamps, drop and count "
                 "late ones; "
                 "always with a camera")
      ->excludes(deterministic);
  command
      ->add_option(
          "--dynamic", arguments->flight.dynamic,
          "Detection of the dynamic objects to remove: none, labels (segmentation network: persons, cars, "
          "bicycles), geometry (depth and optical flow) or both; default both, unless --config differs. For "
          "comparison: ds-slam-like, dynaslam-like")
      ->check(CLI::IsMember(dynamic_modes()));
  add_backend_option(*command, arguments->flight.backend);
  command->add_option("--model", arguments->flight.model,
                      "Weights of the segmentation network (ONNX); default the shipped ones");
  command->add_option("--vocabulary", arguments->flight.vocabulary,
                      "Vocabulary for place recognition (roslam vocabulary train); default the shipped one");
  command->add_flag("--no-loops", arguments->flight.no_loops,
                    "Do no place recognition and close no loops: drift is not corrected");
  command->add_option(
      "--map", arguments->flight.map,
      "Continue from the map of an earlier run with the same camera (its folder or map.roslam)");
  command
      ->add_option(
          "--resume", arguments->resume,
          "Go on with the run in this folder, such as after a power cut: from its last saved map, in a new "
          "submap until the place is recognised; its results so far are kept in RESUME/sessions")
      ->excludes("--out")
      ->excludes("--map");
  command->add_flag("--localise-only", arguments->flight.localise_only,
                    "Localise in --map without changing the map");
  add_flight_options(*command, arguments->flight.source);
  add_degrade_option(*command, arguments->flight.source);
  add_mavlink_options(*command, arguments->flight.mavlink);
  command->add_flag("--print-config", arguments->print_config, "Print the effective options (YAML) and exit");
  command
      ->add_option("--checkpoint", arguments->flight.checkpoint,
                   "Seconds between two saved maps (map.roslam) during the run; 0: only at its end")
      ->check(CLI::Range(0.0, 86400.0))
      ->capture_default_str();
  command->add_flag("--checkpoint-dense", arguments->flight.checkpoint_dense,
                    "Save the dense map (dense.ply) as often, as it was one --checkpoint before");
  command
      ->add_option("--view", arguments->flight.view,
                   "Show the run on a web page at ADDRESS:PORT, default 127.0.0.1:8080 (this computer only); "
                   "at another "
                   "address the page needs the token in the URL that is printed")
      ->expected(0, 1);
  command->add_flag("--video", arguments->flight.video,
                    "Write removal.avi too: each frame with kept and removed points");
  command->add_flag("--no-dense", arguments->flight.no_dense,
                    "Build no dense map, and restore no keyframes for it");
  command->add_flag(
      "--restore", arguments->flight.restore,
      "Write restored keyframes to RUN/restored, as fused into the dense map: removed objects are "
      "filled from earlier keyframes and by inpainting; roslam restore does it later for all frames");
  command->add_option(
      "--models", arguments->flight.models,
      "Folder with the inpainting networks (roslam-restorer-*.onnx); default the shipped ones");
  command->add_flag(
      "--strict", arguments->strict,
      "End with exit code 3 unless every frame of the source has a pose and nothing is doubtful");
  command->add_flag("--overwrite", arguments->flight.overwrite,
                    "Replace files in the folder of --out that no run wrote");
  command->add_flag("--quiet", arguments->flight.quiet, "Print no progress");
  command->add_flag("--json", arguments->json, "Print run.json on stdout as one JSON object");
  command->callback([arguments, version] { execute(*arguments, version); });
}

}  // namespace roslam::app
