// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/run/flight.hpp"

#include <exception>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "apps/roslam/run/view_session.hpp"
#include "apps/roslam/support/live_camera.hpp"
#include "apps/roslam/support/named_path.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/progress.hpp"
#include "apps/roslam/support/restored_folder.hpp"
#include "recording/flight_log.hpp"
#include "recording/process_info.hpp"
#include "recording/removal_log.hpp"
#include "recording/restoration_image.hpp"
#include "roslam/common/error.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"
#include "roslam/sensors/image_file.hpp"
#include "roslam/slam/open_slam.hpp"

namespace roslam::app {

using namespace recording;

namespace {
constexpr const char* kRestorationStrip = "restoration.jpg";

// A run without a single pose is no success, whatever was written.
void require_poses(const Slam& slam, const RunResults& summary, const FrameSource& source,
                   const std::string& name) {
  if (summary.interrupted || !slam.trajectory().empty()) return;
  const std::string skipped = in_words(source.skipped()) + in_words(rejected_by_reason(slam));
  if (slam.frames() == 0) {
    throw InputError(name + ": no frame could be used" + skipped + "; check the images and --camera");
  }
  if (const bool localises = !slam.options().keyframes.enabled; localises || slam.map().session() > 0) {
    throw InputError(name + ": no frame was recognised in the map" + skipped +
                     "; fly where the map was made, or leave out " +
                     (localises ? "--localise-only" : "--map"));
  }
  const std::string reasons = skipped + in_words(source.skipped_depth());
  const bool is_stereo = slam.camera().is_stereo();
  if (summary.without_depth == slam.frames()) {
    throw InputError(name + ": no frame could be tracked, none has " +
                     (is_stereo ? "a right image" : "depth") + reasons +
                     (is_stereo ? "; stereo needs a right image near in time to each left one"
                                : "; RGB-D tracking needs a depth image near in time to each colour image"));
  }
  throw InputError(
      name + ": no frame could be tracked" + reasons + "; tracking starts at an image with " +
      std::to_string(slam.options().tracker.min_initial_points) + " corners of known depth: check " +
      (is_stereo ? "with roslam camera check whether left and right are swapped or rows do not correspond"
                 : "the images and depth_units_per_metre of the camera"));
}

// What takes each frame and its result; null or empty: nothing.
struct Listeners {
  telemetry::MavlinkSender* mavlink;
  FlightLog& flight_log;
  std::optional<RemovalLog>& removal_log;
  ViewSession* view;
};

// Tracks every frame and tells the listeners.
RunResults track(FrameSource& source, Slam& slam, const Listeners& to, bool quiet,
                 const std::stop_token& stop) {
  Progress progress(source.size(), quiet);
  double start_up_seconds = -1.0;
  RunResults results;
  static_cast<RunSummary&>(results) = run_slam(
      source, slam,
      [&](const Frame& frame, const FrameResult& result) {
        if (to.mavlink != nullptr) to.mavlink->add(telemetry::TrackingReport(result));
        to.flight_log.add(result);
        if (to.removal_log) to.removal_log->add(frame, result);
        if (to.view != nullptr) to.view->add(frame, result);
        for (const std::string& warning : result.warnings) progress.print("warning: " + warning);
        if (to.mavlink != nullptr)
          for (const std::string& warning : to.mavlink->take_warnings())
            progress.print("warning: " + warning);
        if (start_up_seconds < 0.0 && result.T_world_camera) start_up_seconds = process_age();
        progress.show(result.index + 1, name_of(result.state));
      },
      stop);
  if (to.mavlink != nullptr) {
    to.mavlink->finish();
    results.mavlink = to.mavlink->report();
    for (const std::string& warning : to.mavlink->take_warnings()) progress.print("warning: " + warning);
  }
  if (start_up_seconds >= 0.0) results.start_up_seconds = start_up_seconds;
  return results;
}

// Restored keyframes; shared with the thread that restores.
struct Restorations {
  RestorationStrip strip;
  std::optional<RestoredFolder> folder;  // where --restore asks for it
};

SlamSetup setup_of(const FlightArguments& arguments, const std::shared_ptr<Restorations>& restorations) {
  SlamSetup setup;
  setup.segmentation_model = arguments.model;
  setup.restoration_models = arguments.models;
  setup.vocabulary = arguments.vocabulary;
  setup.backend = arguments.backend;
  if (!arguments.map.empty()) setup.map = map_file(arguments.map);
  setup.restore_keyframes = arguments.restore;
  setup.on_restored = [restorations](const RestoredKeyframe& keyframe) {
    restorations->strip.add(keyframe.frame.colour, keyframe.view);
    if (restorations->folder)
      restorations->folder->add(keyframe.frame, keyframe.view, time_text(keyframe.frame.timestamp));
  };
  return setup;
}

// Keyframes that an earlier run restored must not pass for those of this one.
void remove_old_keyframes(const std::filesystem::path& folder, const FlightArguments& arguments) {
  RestoredFolder::require_apart(folder / "restored", arguments.source.name);
  RestoredFolder::remove_old(folder / "restored");
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
  if (!arguments.dynamic.empty())
    options.dynamic_objects = *options_of_mode(arguments.dynamic, options.dynamic_objects);
  if (arguments.no_loops) options.loop.enabled = false;
  if (arguments.localise_only) options.keyframes.enabled = false;
  if (arguments.no_dense) options.dense.enabled = false;
  return options;
}

Flight fly(const FlightArguments& arguments, const Options& options, const std::string& version,
           const std::stop_token& stop, const std::stop_token& urgent_stop) {
  if (arguments.view) ViewSession::require_free(*arguments.view);
  Flight flight;
  flight.source = open_source(arguments.source);
  const Camera& camera = flight.source->camera();
  const bool is_live = flight.source->is_live();
  if (is_live && arguments.deterministic)
    throw InputError(arguments.source.name + ": a camera does not wait; leave out --deterministic");
  const Mode mode = arguments.real_time || is_live ? Mode::kRealTime : Mode::kDeterministic;
  const auto restorations = std::make_shared<Restorations>();
  flight.slam = open_slam(camera, options, mode, setup_of(arguments, restorations));
  const auto mavlink = open_mavlink(arguments.mavlink, *flight.slam);
  const RunFolder folder(arguments.out, arguments.overwrite);
  // The recording has the same frames and can be read again.
  flight.description.source = arguments.record.empty() ? arguments.source.name : arguments.record;
  flight.description.camera = arguments.source.camera;
  flight.description.version = version;
  if (!arguments.map.empty()) flight.description.map = map_file(arguments.map).string();
  flight.description.flight = flight_in_words(arguments.source);
  flight.description.resumes = arguments.resume;
  if (flight.slam->options().dynamic_objects.labels)
    flight.description.segmentation_model =
        arguments.model.empty() ? find_segmentation_model().string() : arguments.model;
  remove_old_keyframes(folder.path(), arguments);
  folder.begin(flight.description, camera);
  if (arguments.restore && flight.slam->restores())
    restorations->folder.emplace(folder.path() / "restored", camera);
  std::optional<RemovalLog> log;
  if (flight.slam->options().dynamic_objects.is_on())
    log.emplace(RemovalLog::Settings{folder.path(), mode, camera.fps, arguments.video});
  FlightLog flight_log({folder.path(), arguments.checkpoint, flight.slam->options().keyframes.enabled,
                        arguments.checkpoint_dense},
                       *flight.slam);
  std::optional<SourceRecorder> recorder;
  if (!arguments.record.empty()) recorder.emplace(*flight.source, arguments.record);
  std::optional<ViewSession> view;
  if (arguments.view)
    view.emplace(ViewSession::Setup{*arguments.view, flight.description.id, arguments.source.name,
                                    *flight.slam, *flight.source, stop, [&] { flight_log.save(); }});
  // A second signal may end the program before the trajectory is written anew.
  const std::stop_callback flush(stop, [&] { flight_log.flush(); });
  const Listeners listeners{mavlink.get(), flight_log, log, view ? &*view : nullptr};
  flight.summary = track(view ? view->source() : *flight.source, *flight.slam, listeners, arguments.quiet,
                         view ? view->stop_token() : stop);
  if (view) view->begin_saving();
  // A step that fails must not cost the results of the others.
  std::exception_ptr failure;
  const auto attempt = [&](const auto& step) {
    try {
      step();
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  };
  flight_log.stop();
  // The trajectory and the map before what may take long.
  std::exception_ptr unwritten;
  try {
    folder.write_flight(*flight.slam);
  } catch (...) {
    unwritten = std::current_exception();
  }
  if (recorder) {
    attempt([&] { recorder->close(); });
    flight.recorded = recorder->in_words();
  }
  if (log) attempt([&] { log->finish(); });
  attempt([&] { flight_log.finish(); });
  flight.summary.saving_faults = flight_log.faults();
  // A log that failed has removed its files: on a full disk there may be room now.
  if (unwritten && failure) attempt([&] { folder.write_flight(*flight.slam); });
  if (!failure) failure = unwritten;
  if (flight.slam->restores()) attempt([&] { end_restoration(flight, *restorations, folder); });
  if (log) flight.summary.removal = log->tally();
  attempt([&] { flight.summary.dense = flight.slam->dense_map(urgent_stop); });
  attempt([&] {
    folder.write(*flight.slam, flight.summary, *flight.source, flight.description,
                 [&] { return urgent_stop.stop_requested(); });
  });
  if (failure) std::rethrow_exception(failure);
  if (flight.summary.failure) std::rethrow_exception(flight.summary.failure);
  require_poses(*flight.slam, flight.summary, *flight.source, arguments.source.name);
  return flight;
}

}  // namespace roslam::app
