// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/camera/camera_check_command.hpp"

#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "apps/roslam/camera/camera_notes.hpp"
#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/progress.hpp"
#include "apps/roslam/support/sources.hpp"
#include "evaluation/camera_check/camera_check.hpp"
#include "evaluation/camera_check/stereo_check.hpp"
#include "evaluation/json_number.hpp"
#include "roslam/datasets/dataset.hpp"
#include "simulation/faulty_camera_source.hpp"

namespace roslam::app {

using evaluation::CameraCheck;
using evaluation::CameraFinding;
using evaluation::Contrast;
using evaluation::number;
using evaluation::StereoCheck;

namespace {
using Json = nlohmann::ordered_json;

struct Arguments {
  SourceArguments source;
  std::vector<std::string> faults;
  bool json = false;
  bool quiet = false;
};

using Findings = std::vector<std::pair<std::string, const CameraFinding*>>;

Findings findings(const StereoCheck& check) { return {{"order", &check.order}, {"rows", &check.rows}}; }

Findings findings(const CameraCheck& check) {
  return {{"depth scale", &check.depth_scale},
          {"registration", &check.registration},
          {"timing", &check.timing},
          {"distortion", &check.distortion}};
}

Json json_of(const Contrast& value) {
  return {{"value", number(value.mean)}, {"sigma", number(value.sigma)}};
}

Json json_of(const evaluation::LensFit& fit) {
  return {{"pairs", fit.pairs},
          {"points", fit.points},
          {"error_pixels", number(fit.error)},
          {"outer_error_pixels", number(fit.outer_error)},
          {"error_with_k1_pixels", number(fit.free_error)},
          {"k1_left", json_of(fit.k1)},
          {"focal_left", json_of(fit.focal)},
          {"corner_left_pixels", json_of(fit.corner)},
          {"outermost", number(fit.outermost)}};
}

Json json_of(const evaluation::EdgeFit& fit) {
  return {{"score", number(fit.score)},
          {"score_as_given", number(fit.score_as_given)},
          {"lag_frames", json_of(fit.lag)},
          {"shift_x_pixels", json_of(fit.x)},
          {"shift_y_pixels", json_of(fit.y)},
          {"zoom", json_of(fit.zoom)},
          {"advantage_over_given", json_of(fit.over_given)},
          {"advantage_over_no_lag", json_of(fit.over_in_time)},
          {"advantage_over_registered", json_of(fit.over_registered)},
          {"tells_lag", number(fit.tells_lag)},
          {"tells_registration", number(fit.tells_registration)}};
}

Json report_of(const Findings& findings, bool fits, const SourceArguments& source) {
  Json json{{"source", source.name}, {"nothing_misfits", fits}};
  for (const auto& [name, finding] : findings) {
    std::string key = name;
    std::replace(key.begin(), key.end(), ' ', '_');
    json[key] = {{"verdict", name_of(finding->verdict)}, {"finding", finding->words}};
    if (!finding->remedy.empty()) json[key]["remedy"] = finding->remedy;
  }
  return json;
}

Json report(const StereoCheck& check, const SourceArguments& source) {
  Json json = report_of(findings(check), check.fits(), source);
  json["pairs"] = check.pairs;
  json["matches"] = check.matches;
  json["to_the_left"] = number(check.to_the_left);
  json["to_the_right"] = number(check.to_the_right);
  json["row_offset_pixels"] = number(check.offset);
  json["row_offset_in_worst_corner_pixels"] = number(check.worst);
  return json;
}

Json report(const CameraCheck& check, const SourceArguments& source) {
  Json json = report_of(findings(check), check.fits(), source);
  json["notes"] = preset_notes(source.camera);
  json["frames_read"] = check.frames_read;
  json["runs"] = check.runs;
  json["frame_interval_seconds"] = number(check.interval);
  json["edges"] = check.edges ? json_of(*check.edges) : Json();
  json["lens"] = {{"as_given", json_of(check.as_given)},
                  {"none", json_of(check.none)},
                  {"inverse", json_of(check.inverse)}};
  json["depth"] = {{"times_too_large_by_truth", check.scale ? json_of(*check.scale) : Json()},
                   {"percentile_5_metres", number(check.near)},
                   {"median_metres", number(check.median)},
                   {"percentile_95_metres", number(check.far)},
                   {"sensor_baseline_metres", check.baseline ? Json(*check.baseline) : Json()},
                   {"sensor_step_factor", check.step_factor ? Json(*check.step_factor) : Json()},
                   {"multiples_of_5_units", number(check.multiples_of_five)}};
  return json;
}

void print(const Findings& findings, const SourceArguments& source) {
  for (const auto& [name, finding] : findings) {
    std::cout << name << ": " << name_of(finding->verdict) << "\n  " << finding->words << "\n";
    if (!finding->remedy.empty()) std::cout << "  remedy: " << finding->remedy << "\n";
  }
  for (const std::string& note : preset_notes(source.camera)) std::cout << "note: " << note << "\n";
}

// A TUM RGB-D folder is opened with its true poses, which tracking does without.
std::unique_ptr<FrameSource> open_with_truth(const SourceArguments& arguments) {
  if (simulated_flight(arguments) || is_recorded(arguments.name) || is_other_dataset(arguments.name) ||
      !TumSource::recognises(arguments.name) || arguments.camera.empty())
    return open_source(arguments);
  return open_dataset(arguments.name, load_camera(arguments.camera));
}

void run(const Arguments& arguments) {
  std::unique_ptr<FrameSource> source = open_with_truth(arguments.source);
  if (!arguments.faults.empty()) {
    std::vector<simulation::CameraFault> faults;
    for (const std::string& name : arguments.faults) faults.push_back(*simulation::camera_fault_from(name));
    source = std::make_unique<simulation::FaultyCameraSource>(std::move(source), faults);
  }
  if (!arguments.faults.empty() && source->camera().is_stereo())
    throw InputError(
        "--fault: is of the depth and the lens of cameras with depth, not of stereo pairs; leave it out");
  const InterruptWatcher interrupt;
  std::unique_ptr<Progress> progress;
  const auto show = [&](std::size_t done, std::size_t total) {
    if (!progress) progress = std::make_unique<Progress>(total, arguments.quiet);
    progress->show(done, "read");
  };
  const auto tell = [&](const auto& check) {
    progress.reset();
    if (arguments.json)
      std::cout << report(check, arguments.source).dump(-1, ' ', false, Json::error_handler_t::replace)
                << "\n";
    else
      print(findings(check), arguments.source);
    require_written_output();
    std::string misfits;
    for (const auto& [name, finding] : findings(check))
      if (finding->verdict == evaluation::Verdict::kDoesNotFit)
        misfits += (misfits.empty() ? "" : ", ") + name;
    if (!misfits.empty()) throw FailedCheck(arguments.source.name + ": does not fit its camera: " + misfits);
  };
  if (source->camera().is_stereo()) {
    tell(evaluation::check_stereo(*source, arguments.source.name, show, interrupt.token()));
  } else {
    tell(evaluation::check_camera(*source, arguments.source.name, {}, show, interrupt.token()));
  }
}
}  // namespace

void add_camera_check_command(CLI::App& camera) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      camera.add_subcommand("check",
                            "Tell from a recording whether its camera file fits: lens, depth scale, "
                            "registration and timing of depth; of stereo pairs order and rows");
  command->footer(
      "Examples:\n"
      "  roslam camera check my_flight --camera my_camera.yaml\n"
      "  roslam camera check flight.bag --json\n"
      "Exit code: 0 nothing was found not to fit, 1 an error in the input, 2 wrong usage, 3 something does "
      "not "
      "fit.");
  add_source_options(*command, arguments->source)->required();
  add_topic_options(*command, arguments->source);
  add_flight_options(*command, arguments->source);
  command
      ->add_option("--fault", arguments->faults,
                   "Make the camera wrong, to test the check; several with commas")
      ->delimiter(',')
      ->check(CLI::IsMember(simulation::camera_fault_names()));
  command->add_flag("--json", arguments->json, "Print one JSON object on stdout");
  command->add_flag("--quiet", arguments->quiet, "No progress");
  command->callback([arguments] {
    settle_imu(arguments->source);
    run(*arguments);
  });
}

}  // namespace roslam::app
