// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/flight.hpp"

#include <exception>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "apps/roslam/inpainter.hpp"
#include "apps/roslam/output.hpp"
#include "apps/roslam/progress.hpp"
#include "apps/roslam/restored_folder.hpp"
#include "roslam/atlas/map_file.hpp"
#include "roslam/error.hpp"
#include "roslam/pipeline/removal_log.hpp"
#include "roslam/restoration/restoration_picture.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"
#include "roslam/sources/image_file.hpp"

namespace roslam::app {

namespace {
constexpr const char* kRestorationStrip = "restoration.jpg";

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
std::shared_ptr<Segmenter> open_segmenter(const FlightArguments& arguments, Options& options,
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
std::shared_ptr<const Vocabulary> open_vocabulary(const FlightArguments& arguments, Options& options) {
  if (!options.loop.enabled) return nullptr;
  if (auto vocabulary = load_vocabulary(arguments.vocabulary)) return vocabulary;
  options.loop.enabled = false;
  std::cerr << "note: models/roslam-orb.vocabulary: not found beside the program; no loop is closed. Install "
               "it or name it with --vocabulary\n";
  return nullptr;
}

std::optional<SavedMap> open_map(const FlightArguments& arguments) {
  if (arguments.map.empty()) return std::nullopt;
  return load_map(arguments.map);
}

// Tracks every frame and notes what is removed from it.
RunSummary track(FrameSource& source, Slam& slam, std::optional<RemovalLog>& log, bool quiet,
                 const std::stop_token& stop) {
  Progress progress(source.size(), quiet);
  return run(
      source, slam,
      [&](const Frame& frame, const FrameResult& result) {
        if (log) log->add(frame, result);
        progress.show(result.index + 1, name_of(result.state));
      },
      stop);
}

// Pictures of keyframes that are restored; shared with the thread that restores.
struct Restorations {
  RestorationStrip strip;
  std::optional<RestoredFolder> folder;  // where --restore asks for it
};

// Null if nothing is restored.
std::shared_ptr<Restorations> begin_restoration(Flight& flight, const FlightArguments& arguments,
                                                const RunFolder& run) {
  const auto path = run.path() / "restored";
  RestoredFolder::require_apart(path, arguments.source.name);
  RestoredFolder::remove_old(path);
  const Options& options = flight.slam->options();
  const bool is_for_map = options.dense.enabled && options.dense.restore && options.dense.remove;
  if (!(arguments.restore || is_for_map) || !options.removal.is_on() || !options.keyframes.enabled)
    return nullptr;
  auto result = std::make_shared<Restorations>();
  if (arguments.restore) result->folder.emplace(path, flight.source->camera());
  flight.slam->restore_keyframes(
      open_inpainter(arguments.models), [result](const RestoredKeyframe& keyframe) {
        result->strip.add(keyframe.frame.colour, keyframe.view);
        if (result->folder)
          result->folder->add(keyframe.frame, keyframe.view, time_text(keyframe.frame.timestamp));
      });
  return result;
}

void write_strip(const RestorationStrip& restorations, const std::filesystem::path& file) {
  const cv::Mat strip = restorations.strip();
  if (strip.empty()) return;
  try {
    write_image(file, strip);
  } catch (const OutputError&) {
    std::filesystem::remove(file);  // on a full disk the trajectory needs the room more
    throw;
  }
}

void end_restoration(Flight& flight, Restorations& restorations, const RunFolder& run) {
  write_strip(restorations.strip, run.path() / kRestorationStrip);
  if (!restorations.folder) return;
  RestoredFolder& folder = *restorations.folder;
  flight.restored = folder.frames();
  const nlohmann::ordered_json report{{"source", flight.description.source},
                                      {"method", kInFlight},
                                      {"frames", folder.frames()},
                                      {"dropped", flight.slam->unrestored()},
                                      {"faults", flight.slam->restoration_faults()}};
  folder.close(report.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}
}  // namespace

Options options_of(const FlightArguments& arguments) {
  Options options = arguments.config.empty() ? Options{} : read_options(arguments.config);
  if (!arguments.dynamic.empty()) options.removal = *removal_from(arguments.dynamic, options.removal);
  if (arguments.no_loops) options.loop.enabled = false;
  if (arguments.localise_only) options.keyframes.enabled = false;
  if (arguments.no_dense) options.dense.enabled = false;
  return options;
}

Flight fly(const FlightArguments& arguments, Options options, const std::string& version,
           const std::stop_token& stop) {
  Flight flight;
  flight.source = open_source(arguments.source);
  auto map = open_map(arguments);
  const RunFolder folder(arguments.out);
  flight.description = {arguments.source.name, arguments.source.camera,          version, {},
                        arguments.map,         flight_in_words(arguments.source)};
  const auto segmenter = open_segmenter(arguments, options, flight.description.segmentation_model);
  const Mode mode = arguments.real_time ? Mode::kRealTime : Mode::kDeterministic;
  flight.slam = std::make_unique<Slam>(flight.source->camera(), options, mode, segmenter,
                                       open_vocabulary(arguments, options));
  if (map) flight.slam->continue_from(std::move(*map));
  if (options.dense.enabled && options.keyframes.enabled) flight.slam->map_densely();
  const auto restored = begin_restoration(flight, arguments, folder);
  std::optional<RemovalLog> log;
  RemovalLog::remove_old(folder.path());
  std::filesystem::remove(folder.path() / kRestorationStrip);
  if (options.removal.is_on())
    log.emplace(RemovalLog::Settings{folder.path(), mode, flight.source->camera().fps, arguments.video});
  flight.summary = track(*flight.source, *flight.slam, log, arguments.quiet, stop);
  // The results of the flight matter more than what goes with them.
  std::exception_ptr failure;
  const auto attempt = [&](const auto& step) {
    try {
      step();
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  };
  if (log) attempt([&] { log->finish(); });
  if (restored) attempt([&] { end_restoration(flight, *restored, folder); });
  if (log) flight.summary.removal = log->tally();
  attempt([&] { folder.write_flight(*flight.slam); });
  attempt([&] { flight.summary.dense = flight.slam->dense_map(); });
  attempt([&] { folder.write(*flight.slam, flight.summary, *flight.source, flight.description); });
  if (failure) std::rethrow_exception(failure);
  if (flight.summary.failure) std::rethrow_exception(flight.summary.failure);
  require_poses(*flight.slam, flight.summary, *flight.source, arguments.source.name);
  return flight;
}

}  // namespace roslam::app
