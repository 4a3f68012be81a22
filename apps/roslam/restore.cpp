// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/roslam/run/flight.hpp"
#include "apps/roslam/support/backend_option.hpp"
#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/inpainter.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/progress.hpp"
#include "apps/roslam/support/restored_folder.hpp"
#include "apps/roslam/support/run_source.hpp"
#include "apps/roslam/support/sources.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "evaluation/statistics.hpp"
#include "recording/recorded_run.hpp"
#include "recording/sequence_restorer.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/stopwatch.hpp"
#include "roslam/common/write_file.hpp"
#include "roslam/datasets/folder_source.hpp"
#include "roslam/datasets/tum_source.hpp"
#include "roslam/options/settings.hpp"
#include "roslam/stereo/rectified_source.hpp"

namespace roslam::app {

using namespace evaluation;
using namespace recording;
using namespace simulation;

namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct RestoreArguments {
  FlightArguments flight;  // for a source that has no run yet
  fs::path out;
  fs::path models;
  std::string method;     // empty: as the options say
  std::size_t every = 1;  // every so many-th frame is restored
  bool json = false;
};

std::string name_of_files(const FrameSource& source, const Frame& frame) {
  if (const auto* pairs = dynamic_cast<const RectifiedSource*>(&source))
    return name_of_files(pairs->source(), frame);
  if (const auto* folder = dynamic_cast<const TumSource*>(&source))
    return folder->colour_file(frame.index).stem().string();
  if (const auto* folder = dynamic_cast<const FolderSource*>(&source))
    return folder->files(frame.index).colour.stem().string();
  return time_text(frame.timestamp);
}

std::shared_ptr<Inpainter> inpainter_for(const RestoreArguments& arguments,
                                         const RestorationOptions& options) {
  if (arguments.method == "gan") return require_inpainter(arguments.models, arguments.flight.backend);
  const bool is_wanted = options.inpaint && (arguments.method.empty() || arguments.method == "both");
  return is_wanted ? app::open_inpainter(arguments.models, arguments.flight.backend) : nullptr;
}

StaticSceneRestorer::Settings settings_for(const RestoreArguments& arguments, const RecordedRun& run) {
  const bool has_config = !arguments.flight.config.empty();
  const Options options = has_config ? read_options(arguments.flight.config) : run.removal().options();
  StaticSceneRestorer::Settings settings = restorer_settings(options);
  if (arguments.method.empty()) return settings;
  settings.restoration.reproject = arguments.method == "both" || arguments.method == "reprojection";
  settings.restoration.inpaint = arguments.method != "reprojection";
  if (arguments.method == "navier-stokes") settings.inpainting.classic = ClassicMethod::kNavierStokes;
  return settings;
}

// The folder of the run; for a source without a run, roslam run is executed first.
fs::path run_folder_of(const RestoreArguments& arguments, const std::string& version,
                       const std::stop_token& stop) {
  const std::string& name = arguments.flight.source.name;
  if (RecordedRun::recognises(name)) return name;
  FlightArguments flight = arguments.flight;
  flight.out = (arguments.out / "run").string();
  flight.no_dense = true;
  fly(flight, options_of(flight), version, stop);
  return flight.out;
}

struct Restored {
  std::vector<double> milliseconds;  // processor time of each frame with holes
  std::map<std::string, std::size_t> left_out;
};

void keep_sources(SequenceRestorer& sequence, FrameSource& source, bool quiet, const std::stop_token& stop) {
  Progress progress(source.size(), quiet);
  while (!stop.stop_requested()) {
    const auto frame = source.next();
    if (!frame) return;
    if (sequence.is_source(frame->timestamp)) sequence.keep(*frame);
    progress.show(frame->index + 1, "read");
  }
}

Restored restore_all(SequenceRestorer& sequence, FrameSource& source, RestoredFolder& folder,
                     const RestoreArguments& arguments, const std::stop_token& stop) {
  Restored restored;
  Progress progress(source.size(), arguments.flight.quiet);
  while (!stop.stop_requested()) {
    const auto frame = source.next();
    if (!frame) break;
    if (frame->index % arguments.every != 0) continue;
    const Stopwatch watch;
    const auto view = sequence.restore(*frame);
    if (view) {
      if (view->pixels_of(Provenance::kMeasured) < view->colour.total())
        restored.milliseconds.push_back(1000.0 * watch.seconds());
      folder.add(*frame, *view, name_of_files(source, *frame));
    }
    progress.show(frame->index + 1, "restored");
  }
  restored.left_out = sequence.left_out();
  for (const auto& [reason, count] : source.skipped()) restored.left_out[reason] += count;
  return restored;
}

Json report_of(const RestoreArguments& arguments, const RecordedRun& run, const RestoredFolder& folder,
               const Restored& restored, std::size_t sources, bool has_network, bool interrupted) {
  const auto hole = static_cast<double>(folder.reprojected() + folder.inpainted());
  const auto share = [&](std::size_t pixels) {
    return hole > 0.0 ? Json(static_cast<double>(pixels) / hole) : Json(nullptr);
  };
  return {{"source", run.source().name},
          {"out", arguments.out.string()},
          {"method", arguments.method.empty() ? "both" : arguments.method},
          {"network", has_network},
          {"interrupted", interrupted},
          {"frames", folder.frames()},
          {"left_out", restored.left_out},
          {"frames_filled_from", sources},
          {"hole_share", hole / std::max(1.0, hole + static_cast<double>(folder.measured()))},
          {"reprojected_share_of_hole", share(folder.reprojected())},
          {"inpainted_share_of_hole", share(folder.inpainted())},
          {"processor_milliseconds_a_frame",
           restored.milliseconds.empty() ? Json(nullptr) : Json(median(restored.milliseconds))}};
}

void print(const Json& report) {
  const auto percent = [&](const char* key) {
    return report[key].is_null() ? std::string("-") : fixed(100.0 * report[key].get<double>(), 1) + " %";
  };
  std::cout << "restored " << report["frames"] << " frames from " << report["frames_filled_from"]
            << " of them\n"
            << "removed: " << percent("hole_share") << " of the image area; of that reprojected "
            << percent("reprojected_share_of_hole") << ", inpainted " << percent("inpainted_share_of_hole")
            << "\n";
  for (const auto& [reason, count] : report["left_out"].items())
    std::cout << "not restored: " << count << " x " << reason << "\n";
  if (!report["processor_milliseconds_a_frame"].is_null())
    std::cout << "median " << fixed(report["processor_milliseconds_a_frame"].get<double>(), 0)
              << " ms of processor time per frame with holes\n";
  std::cout << "results: " << report["out"].get<std::string>() << "\n";
}

void restore(RestoreArguments arguments, const std::string& version) {
  const InterruptWatcher interrupt;
  const std::stop_token stop = interrupt.token();
  arguments.flight.quiet |= arguments.json;
  RestoredFolder::require_usable(arguments.out);
  RestoredFolder::require_apart(arguments.out, arguments.flight.source.name);
  const RecordedRun run(run_folder_of(arguments, version, stop));
  RestoredFolder::require_apart(arguments.out, run.source().name);
  const auto settings = settings_for(arguments, run);
  const auto first_pass = open_source_of(run.source());  // reports its errors before anything else is done
  const auto inpainter = inpainter_for(arguments, settings.restoration);
  StaticSceneRestorer restorer(run.camera(), settings, inpainter);
  SequenceRestorer sequence(run, restorer);
  keep_sources(sequence, *first_pass, arguments.flight.quiet, stop);
  if (stop.stop_requested()) {  // before the results of an earlier call are replaced
    std::cerr << "interrupted before anything was restored\n";
    return;
  }
  RestoredFolder folder(arguments.out, run.camera());
  const Restored restored = restore_all(sequence, *open_source_of(run.source()), folder, arguments, stop);
  const Json report = report_of(arguments, run, folder, restored, sequence.sources(), inpainter != nullptr,
                                stop.stop_requested());
  folder.close(report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
  if (folder.frames() == 0 && !stop.stop_requested())
    throw InputError(run.source().name + ": no frame could be restored" + in_words(restored.left_out) +
                     "; is it the source of the run?");
  if (arguments.json) {
    std::cout << report.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    print(report);
  }
  require_written_output();
}

// Options of the source are recorded in the run and must not contradict it.
void require_no_flight_options(const CLI::App& command) {
  for (const char* name :
       {"--camera", "--traffic", "--frames", "--seed", "--speed", "--altitude", "--aside", "--fps", "--gusts",
        "--gain", "--colour", "--depth", "--truth", "--imu", "--stereo"})
    if (command.count(name) > 0) throw CLI::ValidationError(name, "is known from the run; leave it out");
}
}  // namespace

void add_restore_command(CLI::App& program, const std::string& version) {
  const auto arguments = std::make_shared<RestoreArguments>();
  CLI::App* command = program.add_subcommand(
      "restore", "Write a sequence with its dynamic objects replaced by the static background");
  command->footer(
      "Examples:\n"
      "  roslam restore rgbd_dataset_freiburg3_walking_xyz --camera tum-fr3 --out walking_static\n"
      "  roslam run my_flight --camera my_camera.yaml --out run\n"
      "  roslam restore run --out my_flight_static\n"
      "SOURCE is the folder of a run, or a source for roslam run, which is then run first, to DIR/run.\n"
      "Pixels of dynamic objects are reprojected from other images where these show the background, and\n"
      "inpainted elsewhere. Writes to the folder DIR of --out a sequence in TUM RGB-D format:\n"
      "  rgb/ rgb.txt depth/ depth.txt camera.yaml   names and timestamps as in the source\n"
      "  provenance/        origin of each pixel, 8 bit: 0 measured, 128 reprojected, 255 inpainted\n"
      "  before_after.jpg   frames as taken, restored, and marked: reprojected green, inpainted magenta\n"
      "  restoration.json   settings and counts\n"
      "Ctrl-C ends it early and keeps the frames restored so far.\n"
      "Exit code: 0 success, 1 an error in the input, 2 wrong usage.");
  add_source_options(*command, arguments->flight.source)->required();
  add_topic_options(*command, arguments->flight.source);
  command->add_option("--out", arguments->out, "Folder the sequence is written to; made if it does not exist")
      ->required();
  command
      ->add_option(
          "--method", arguments->method,
          "both: reprojection, then inpainting by the network (default, unless the options differ). For "
          "comparison: reprojection alone (the rest stays black), or inpainting alone by gan (the "
          "network), telea or navier-stokes (OpenCV)")
      ->check(CLI::IsMember({"both", "reprojection", "gan", "telea", "navier-stokes"}));
  command->add_option(
      "--models", arguments->models,
      "Folder with the inpainting networks (roslam-restorer-*.onnx); default the shipped ones");
  add_backend_option(*command, arguments->flight.backend);
  command
      ->add_option("--every", arguments->every,
                   "Restore every N-th frame; the others still serve as source images")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--config", arguments->flight.config,
                      "YAML file with options; default the options of the run");
  add_flight_options(*command, arguments->flight.source);
  command->add_flag("--quiet", arguments->flight.quiet, "Print no progress");
  command->add_flag("--json", arguments->json, "Print the summary as one JSON object on stdout");
  command->callback([arguments, command, version] {
    if (RecordedRun::recognises(arguments->flight.source.name)) require_no_flight_options(*command);
    restore(*arguments, version);
  });
}

}  // namespace roslam::app
