// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/interrupt.hpp"
#include "apps/roslam/support/output.hpp"
#include "apps/roslam/support/progress.hpp"
#include "apps/roslam/support/replaces_only.hpp"
#include "apps/roslam/support/run_source.hpp"
#include "recording/mcap_export.hpp"
#include "roslam/common/error.hpp"

namespace roslam::app {

using namespace recording;

namespace {
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct Arguments {
  fs::path run;
  fs::path file;
  bool no_images = false;
  std::size_t every = 1;                // every so many-th image is exported
  std::size_t most_points = 5'000'000;  // of a map; 80 MB
  McapExportOptions options;
  bool quiet = false;
  bool json = false;
};

constexpr auto kExamples = R"(Examples:
  roslam export run --mcap run.mcap
  roslam export run --mcap run.mcap --no-images
  roslam export run --mcap run.mcap --every 10 --jpeg-quality 70

Foxglove, Lichtblick, rerun and ros2 bag play read the file. Topics, as far as the run has them:
  /tf /tf_static               map, odom, base_link, camera_optical_frame (REP 105)
  /odometry                    pose and velocity of the body with covariances
  /camera_pose /path           the trajectory
  /ground_truth/path           true poses, aligned to the trajectory
  /map/landmarks /map/dense    points of both maps
  /camera/image/compressed     images of the source of the run, with /camera/camera_info
  /camera/removed/compressed   the same with removed objects in red
Images are read from the source of the run once more; where it is not there any more, the rest is exported.
Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

// The time after which images of the source are not of the run: one that ended early used a part of it.
double end_of(const RunContents& run) {
  constexpr double kNever = std::numeric_limits<double>::infinity();
  if (run.source.is_whole) return kNever;
  double end = -kNever;
  if (!run.trajectory.empty()) end = run.trajectory.back().timestamp;
  if (!run.odometry.empty()) end = std::max(end, run.odometry.back().timestamp);
  constexpr double kSameTime = 1e-6;  // seconds; files have six decimals
  return end + kSameTime;
}

void add_images(McapExport& out, FrameSource& source, double end, const Arguments& arguments,
                const std::stop_token& stop) {
  Progress progress(source.size(), arguments.quiet || arguments.json);
  while (const auto frame = source.next(stop)) {
    if (frame->timestamp > end) return;
    if (frame->index % arguments.every == 0) out.add(*frame);
    progress.show(frame->index + 1, "exported");
  }
}

Json report_of(const Arguments& arguments, const McapExport& out, const std::vector<std::string>& notes) {
  const TopicFile& file = out.file();
  Json topics = Json::array();
  for (const TopicFile::Topic& topic : file.topics())
    topics.push_back(
        {{"name", topic.name}, {"type", topic.type}, {"messages", topic.messages}, {"bytes", topic.bytes}});
  const auto range = file.time_range();
  const auto seconds = [](std::int64_t stamp) { return static_cast<double>(stamp) * 1e-9; };
  return {{"run", arguments.run.string()},
          {"file", arguments.file.string()},
          {"bytes", file.bytes()},
          {"start", range ? Json(seconds(range->first)) : Json(nullptr)},
          {"end", range ? Json(seconds(range->second)) : Json(nullptr)},
          {"topics", topics},
          {"left_out", out.left_out()},
          {"notes", notes}};
}

void print(const Json& report) {
  constexpr double kMegabyte = 1e6;
  for (const Json& topic : report["topics"])
    std::printf("%-28s %-32s %7zu messages %9.1f MB\n", topic["name"].get<std::string>().c_str(),
                topic["type"].get<std::string>().c_str(), topic["messages"].get<std::size_t>(),
                topic["bytes"].get<double>() / kMegabyte);
  for (const Json& note : report["notes"]) std::cerr << "note: " << note.get<std::string>() << "\n";
  for (const auto& [reason, count] : report["left_out"].items())
    std::cerr << "note: " << count << " x " << reason << "\n";
  std::printf("wrote %.1f MB: %s\n", report["bytes"].get<double>() / kMegabyte,
              report["file"].get<std::string>().c_str());
}

void export_run(const Arguments& arguments) {
  const InterruptWatcher interrupt;
  const std::stop_token stop = interrupt.token();
  RunContents run = read_run_contents(arguments.run, arguments.most_points);
  std::vector<std::string> notes = run.notes;
  const RunSource origin = run.source;
  const double end = end_of(run);
  std::unique_ptr<FrameSource> source;
  // A source that is gone or was changed since costs the images only.
  const auto attempt = [&](const auto& work) {
    try {
      work();
    } catch (const OutputError&) {
      throw;
    } catch (const Error& error) {
      notes.push_back(std::string("images are missing: ") + error.what());
    }
  };
  if (!arguments.no_images) attempt([&] { source = open_source_of(origin); });
  McapExport out(arguments.file, std::move(run), arguments.options);
  if (source) {
    attempt([&] { add_images(out, *source, end, arguments, stop); });
    for (const auto& [reason, count] : source->skipped())
      notes.push_back(std::to_string(count) + " x image of the source skipped: " + reason);
  }
  if (stop.stop_requested())
    throw OutputError(arguments.file.string() + ": interrupted before it was complete; nothing was written");
  out.finish();
  const Json report = report_of(arguments, out, notes);
  if (arguments.json) {
    std::cout << report.dump(-1, ' ', false, Json::error_handler_t::replace) << "\n";
  } else {
    print(report);
  }
  require_written_output();
}
}  // namespace

void add_export_command(CLI::App& program) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("export", "Export a run to a file for viewers (MCAP)");
  command->footer(kExamples);
  command->add_option("RUN", arguments->run, "Folder that roslam run wrote")->required();
  command->add_option("--mcap", arguments->file, "MCAP file to write")
      ->required()
      ->check(ReplacesOnly({"\x89MCAP0\r\n"}));
  command->add_flag("--no-images", arguments->no_images, "Leave out the images");
  command->add_option("--every", arguments->every, "Export every N-th image; poses are all exported")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--jpeg-quality", arguments->options.jpeg_quality, "Quality of the images")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  command
      ->add_option("--max-points", arguments->most_points,
                   "Points of each map at most; of more, as many are exported, evenly chosen")
      ->check(CLI::Range(std::size_t{1}, std::size_t{15'000'000}))
      ->capture_default_str();
  command->add_flag("--quiet", arguments->quiet, "Print no progress");
  command->add_flag("--json", arguments->json, "Print the summary as one JSON object on stdout");
  command->callback([arguments] { export_run(*arguments); });
}

}  // namespace roslam::app
