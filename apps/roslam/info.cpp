// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/roslam/support/commands.hpp"
#include "apps/roslam/support/output.hpp"
#include "evaluation/json_number.hpp"
#include "evaluation/plots/markdown_table.hpp"
#include "roslam/common/error.hpp"
#include "roslam/common/formatted.hpp"
#include "roslam/ros/recording_streams.hpp"

namespace roslam::app {

using evaluation::fixed;
using evaluation::markdown_table;
using evaluation::table_cell;
using evaluation::TableRow;

namespace {
using Json = nlohmann::ordered_json;

constexpr auto kExamples = R"(Examples:
  What is in a recording, and what would roslam run take of it?
    roslam info flight.bag
    roslam info rosbag2_2026_05_04 --json

Reads ROS 1 bags, rosbag2 files (SQLite) and MCAP files, of the RealSense SDK and of ROS drivers, as a whole. A gap is
a time between two images of more than 2.5 median intervals.
Exit code: 0 success, 1 an error in the input, 2 wrong usage.)";

struct Gaps {
  std::size_t count = 0;
  double longest = 0.0;  // seconds
};

Gaps gaps_of(const RecordedImages& images) {
  constexpr double kGap = 2.5;  // intervals
  Gaps gaps;
  const double rate = images.rate();
  for (std::size_t i = 1; rate > 0.0 && i < images.stamps.size(); ++i) {
    const double step = (seconds_of(images.stamps[i]) - seconds_of(images.stamps[i - 1]));
    if (step * rate <= kGap) continue;
    ++gaps.count;
    gaps.longest = std::max(gaps.longest, step);
  }
  return gaps;
}

std::string size_of(const RecordedImages& images) {
  return images.size.empty() ? "-"
                             : std::to_string(images.size.width) + "x" + std::to_string(images.size.height);
}

std::string calibration_of(const RecordedImages& images) {
  if (!images.info) return "none";
  const auto& K = images.info->K;
  std::string text = formatted("fx %.6g fy %.6g cx %.6g cy %.6g", K[0], K[4], K[2], K[5]);
  if (!images.info->model.empty()) text += ", " + images.info->model;
  for (const double value : images.info->distortion) text += " " + fixed(value, 5);
  return text;
}

// What roslam run would take, or why it would take nothing.
struct Taken {
  std::optional<RecordingStreams> streams;
  std::string error;
};

Taken taken_of(const RecordingContents& contents, const std::string& file) {
  try {
    return {choose_streams(contents, {}, std::nullopt, file), {}};
  } catch (const Error& error) {
    return {std::nullopt, error.what()};
  }
}

double seconds_of_range(const Recording& recording) {
  const auto range = recording.time_range();
  return range ? (static_cast<double>(range->second) - static_cast<double>(range->first)) * 1e-9 : 0.0;
}

void print(const Recording& recording, const RecordingContents& contents, const Taken& taken) {
  std::cout << recording.container() << (contents.is_realsense ? " of the RealSense SDK" : "") << ", "
            << fixed(seconds_of_range(recording), 1) << " s\n\n";
  std::vector<TableRow> topics{{"topic", "type", "messages"}};
  for (const RecordedTopic& topic : recording.topics())
    topics.push_back({table_cell(topic.name), table_cell(topic.type),
                      topic.messages ? std::to_string(*topic.messages) : "-"});
  std::cout << markdown_table(topics) << "\n";
  if (!contents.images.empty()) {
    std::vector<TableRow> rows{
        {"images", "encoding", "size", "read", "rate Hz", "gaps", "longest s", "frame", "clock"}};
    for (const RecordedImages& images : contents.images) {
      const Gaps gaps = gaps_of(images);
      rows.push_back({table_cell(images.topic.name), table_cell(images.encoding), size_of(images),
                      std::to_string(images.stamps.size()), fixed(images.rate(), 2),
                      std::to_string(gaps.count), fixed(gaps.longest, 2), table_cell(images.frame),
                      table_cell(images.clock)});
    }
    std::cout << markdown_table(rows) << "\n";
    for (const RecordedImages& images : contents.images) {
      std::cout << "calibration of " << images.topic.name << ": " << calibration_of(images) << "\n";
      for (const auto& [fault, count] : images.faults)
        std::cout << "  " << count << " cannot be read: " << fault << "\n";
    }
    std::cout << "\n";
  }
  for (const auto& [note, count] : recording.notes()) std::cout << "note: " << count << " x " << note << "\n";
  if (!taken.streams) {
    std::cout << "roslam run would take nothing: " << taken.error << "\n";
    return;
  }
  const RecordingStreams& streams = *taken.streams;
  std::cout << "roslam run would take\n  colour    " << streams.colour.topic.name << "\n  depth     "
            << streams.depth.topic.name
            << (streams.T_colour_depth ? ", to be registered to colour" : ", as registered to colour");
  if (streams.camera.depth_units_per_metre > 0.0)
    std::cout << ", " << formatted("%.6g units a metre", streams.camera.depth_units_per_metre);
  if (contents.camera) std::cout << "\n  camera    " << kCameraTopic << ", with mount and noise";
  std::cout << "\n  inertial  ";
  for (const RecordedTopic& topic : streams.inertial) std::cout << topic.name << " ";
  std::cout << (streams.inertial.empty() ? "none" : "") << "\n  truth     "
            << (streams.truth ? streams.truth->name : "none") << "\n";
  for (const auto& [note, count] : streams.notes) std::cout << "note: " << note << "\n";
}

Json json_of(const Recording& recording, const RecordingContents& contents, const Taken& taken) {
  Json json{{"container", recording.container()},
            {"realsense_sdk", contents.is_realsense},
            {"seconds", seconds_of_range(recording)},
            {"topics", Json::array()},
            {"images", Json::array()},
            {"notes", recording.notes()}};
  for (const RecordedTopic& topic : recording.topics())
    json["topics"].push_back({{"name", topic.name},
                              {"type", topic.type},
                              {"messages", topic.messages ? Json(*topic.messages) : Json(nullptr)}});
  for (const RecordedImages& images : contents.images) {
    const Gaps gaps = gaps_of(images);
    json["images"].push_back({{"topic", images.topic.name},
                              {"encoding", images.encoding},
                              {"width", images.size.width},
                              {"height", images.size.height},
                              {"read", images.stamps.size()},
                              {"rate_hz", images.rate()},
                              {"gaps", gaps.count},
                              {"longest_gap_s", gaps.longest},
                              {"frame", images.frame},
                              {"clock", images.clock},
                              {"calibration", calibration_of(images)},
                              {"faults", images.faults}});
  }
  json["run_takes"] = nullptr;
  if (taken.streams) {
    Json inertial = Json::array();
    for (const RecordedTopic& topic : taken.streams->inertial) inertial.push_back(topic.name);
    json["run_takes"] = {{"colour", taken.streams->colour.topic.name},
                         {"depth", taken.streams->depth.topic.name},
                         {"registers_depth", taken.streams->T_colour_depth.has_value()},
                         {"depth_units_per_metre", taken.streams->camera.depth_units_per_metre},
                         {"inertial", inertial},
                         {"truth", taken.streams->truth ? Json(taken.streams->truth->name) : Json(nullptr)},
                         {"notes", taken.streams->notes}};
  } else {
    json["run_takes_nothing"] = taken.error;
  }
  return json;
}

struct Arguments {
  std::string file;
  bool json = false;
};

void run(const Arguments& arguments) {
  if (!is_recording(arguments.file))
    throw InputError(
        arguments.file +
        (std::filesystem::exists(arguments.file)
             ? ": is no recording that is known; roslam info reads ROS 1 bags, rosbag2 files and MCAP files"
             : ": no such file; give a ROS 1 bag, a rosbag2 file or folder, or an MCAP file"));
  const auto recording = open_recording(arguments.file);
  const RecordingContents contents = contents_of(*recording, LookAt::kWhole);
  const Taken taken = taken_of(contents, arguments.file);
  if (arguments.json) {
    std::cout << json_of(*recording, contents, taken).dump(2, ' ', false, Json::error_handler_t::replace)
              << "\n";
  } else {
    print(*recording, contents, taken);
  }
  require_written_output();
}
}  // namespace

void add_info_command(CLI::App& program) {
  auto* command = program.add_subcommand("info", "List topics, rates and calibrations of a recording");
  const auto arguments = std::make_shared<Arguments>();
  command->add_option("FILE", arguments->file, "ROS 1 bag, rosbag2 file (.db3) or folder, or MCAP file")
      ->required();
  command->add_flag("--json", arguments->json, "Print one JSON object on stdout instead of tables");
  command->footer(kExamples);
  command->callback([arguments] { run(*arguments); });
}

}  // namespace roslam::app
