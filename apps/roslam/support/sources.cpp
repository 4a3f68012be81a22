// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/sources.hpp"

#include <iomanip>
#include <limits>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "apps/roslam/support/live_camera.hpp"
#include "roslam/common/error.hpp"
#include "roslam/datasets/dataset.hpp"
#include "roslam/ros/recording_source.hpp"
#include "simulation/degraded_source.hpp"
#include "simulation/simulated_source.hpp"

namespace roslam::app {

using namespace simulation;

namespace {
constexpr std::string_view kSimulated = "simulated:";

template <typename Arguments, typename Visitor>
void for_each_topic(Arguments& arguments, const Visitor& visit) {
  visit("colour", arguments.topics.colour);
  visit("depth", arguments.topics.depth);
  visit("inertial", arguments.topics.inertial);
  visit("truth", arguments.topics.truth);
}

// Lists the options of a simulated flight once, for both writing and reading.
template <typename Arguments, typename Visitor>
void for_each_flight_option(Arguments& arguments, const Visitor& visit) {
  visit("traffic", arguments.traffic);
  visit("frames", arguments.frames);
  visit("seed", arguments.seed);
  visit("speed", arguments.speed);
  visit("altitude", arguments.altitude);
  visit("aside", arguments.aside);
  visit("fps", arguments.fps);
  visit("gusts", arguments.gusts);
  visit("imu", arguments.imu);
  visit("stereo", arguments.stereo);
  visit("gain", arguments.gain);
}
}  // namespace

CLI::Option* add_source_options(CLI::App& command, SourceArguments& arguments) {
  CLI::Option* source = command.add_option(
      "SOURCE", arguments.name,
      "Folder of a dataset (TUM RGB-D, 7-Scenes, ScanNet, ICL-NUIM, "
      "OpenLORIS; stereo pairs of EuRoC, KITTI odometry), recording (ROS 1 bag, rosbag2 file or folder, "
      "MCAP), camera (realsense, "
      "realsense:SERIAL), or "
      "simulated:street, simulated:loop, simulated:hover, simulated:turn, simulated:corridor");
  command.add_option(
      "--camera", arguments.camera,
      "Camera of the folder: a preset (tum-fr1 tum-fr2 tum-fr3 bonn 7scenes d435 d455 simulated) "
      "or a YAML file; not "
      "needed where the source knows it");
  return source;
}

void add_topic_options(CLI::App& command, SourceArguments& arguments) {
  command.add_option(
      "--colour", arguments.topics.colour,
      "Topic of the colour (or grey) images of a recording; default the one that fits, see roslam info");
  command.add_option("--depth", arguments.topics.depth, "Topic of the depth images of a recording");
  command.add_option("--truth", arguments.topics.truth,
                     "Topic of ground truth poses in a recording; of tf, TOPIC:CHILD_FRAME");
}

void add_stream_option(CLI::App& command, SourceArguments& arguments) {
  command.add_option(
      "--stream", arguments.stream,
      "Images of a camera that is connected: WIDTHxHEIGHT@RATE, default 640x480@30; fewer a second by "
      "USB 2");
}

void add_mount_option(CLI::App& command, SourceArguments& arguments) {
  command.add_option(
      "--mount", arguments.mount,
      "How the camera is mounted on the drone: X,Y,Z,ROLL,PITCH,YAW of its housing in the body "
      "frame (x forward, y left, z up; metres, degrees; positive pitch looks down); default as the "
      "camera file says, else looking ahead");
}

void add_degrade_option(CLI::App& command, SourceArguments& arguments) {
  command
      .add_option(
          "--degrade", arguments.degrade,
          "Make the images worse, to test robustness: take each 2nd to 5th only, blur a third, step the "
          "exposure, leave out bursts of 0.2 to 1 s")
      ->check(CLI::IsMember(degradation_names()))
      ->capture_default_str();
}

void add_flight_options(CLI::App& command, SourceArguments& arguments) {
  command.add_option("--traffic", arguments.traffic, "Traffic of a simulated flight: none, light or heavy")
      ->check(CLI::IsMember({"none", "light", "heavy"}))
      ->capture_default_str();
  command.add_option("--frames", arguments.frames, "Number of frames of a simulated flight; 0 = all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_option("--seed", arguments.seed, "Seed of a simulated flight")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command.add_option("--speed", arguments.speed, "Speed of a simulated flight, m/s")->capture_default_str();
  command
      .add_option("--altitude", arguments.altitude, "Altitude of a simulated flight, metres above the street")
      ->capture_default_str();
  command
      .add_option("--aside", arguments.aside,
                  "Offset of a simulated flight to the left of the default path, metres")
      ->capture_default_str();
  command.add_option("--fps", arguments.fps, "Frames a second of a simulated flight")->capture_default_str();
  command
      .add_option("--gusts", arguments.gusts,
                  "Gusts of wind of a simulated flight: 0 calm air, 1 turns the drone at up to 60 degrees/s")
      ->capture_default_str();
  command
      .add_option_function<std::string>(
          "--imu",
          [&arguments](const std::string& topic) {
            arguments.imu = topic.empty();
            arguments.topics.inertial = topic;
          },
          "A simulated flight has a gyroscope and an accelerometer as well, 200 Hz; with a TOPIC: that of "
          "the "
          "inertial samples of a recording")
      ->type_name("[TOPIC]")
      ->expected(0, 1);
  command.add_flag("--stereo", arguments.stereo,
                   "A simulated flight has a second camera, 0.12 m to the right, and no depth camera");
  command.add_option("--gain", arguments.gain, "Factor of the image brightness of a simulated flight")
      ->capture_default_str();
}

void settle_imu(SourceArguments& arguments) {
  if (!arguments.name.empty() || arguments.topics.inertial.empty()) return;
  arguments.name = std::exchange(arguments.topics.inertial, {});
  arguments.imu = true;
}

bool is_recorded(const std::string& name) {
  return !is_live_camera(name) && !TumSource::recognises(name) && is_recording(name);
}

bool is_other_dataset(const std::string& name) {
  const auto format = dataset_format(name);
  return format && !(*format == DatasetFormat::kTum && TumSource::recognises(name));
}

std::optional<SimulatorOptions> simulated_flight(const SourceArguments& arguments) {
  if (!arguments.name.starts_with(kSimulated)) return std::nullopt;
  const auto path = flight_path_from(arguments.name.substr(kSimulated.size()));
  const auto traffic = traffic_level_from(arguments.traffic);
  if (!path)
    throw InputError(arguments.name +
                     ": no such flight; use simulated:street, :loop, :hover, :turn or :corridor");
  if (!traffic) throw InputError("--traffic " + arguments.traffic + ": use none, light or heavy");
  if (!arguments.camera.empty() && arguments.camera != "simulated") {
    throw InputError("--camera " + arguments.camera +
                     ": a simulated flight has a camera of its own; leave it out");
  }
  if (!arguments.mount.empty())
    throw InputError("--mount " + arguments.mount +
                     ": a simulated flight knows how its camera is mounted; leave it out");
  SimulatorOptions options;
  options.path = *path;
  options.traffic = *traffic;
  options.frames = arguments.frames;
  options.seed = arguments.seed;
  options.speed = arguments.speed;
  options.altitude = arguments.altitude;
  options.aside = arguments.aside;
  options.fps = arguments.fps;
  options.gusts = arguments.gusts;
  options.imu = arguments.imu;
  options.stereo = arguments.stereo;
  options.gain = arguments.gain;
  return options;
}

std::map<std::string, std::string> flight_in_words(const SourceArguments& arguments) {
  std::map<std::string, std::string> words;
  if (!arguments.name.starts_with(kSimulated)) {
    for_each_topic(arguments, [&](const char* name, const std::string& topic) {
      if (!topic.empty()) words[name] = topic;
    });
    return words;
  }
  for_each_flight_option(arguments, [&](const char* name, const auto& value) {
    std::ostringstream text;
    text << std::setprecision(std::numeric_limits<double>::max_digits10) << value;
    words[name] = text.str();
  });
  return words;
}

SourceArguments flight_from_words(const std::string& name, const std::map<std::string, std::string>& words) {
  SourceArguments arguments;
  arguments.name = name;
  if (!name.starts_with(kSimulated)) {
    for_each_topic(arguments, [&](const char* key, std::string& topic) {
      if (const auto found = words.find(key); found != words.end()) topic = found->second;
    });
    return arguments;
  }
  for_each_flight_option(arguments, [&](const char* key, auto& value) {
    const auto found = words.find(key);
    if (found == words.end()) return;
    std::istringstream text(found->second);
    const bool is_number = (text >> value) && text.peek() == std::istringstream::traits_type::eof();
    const bool is_negative =
        std::is_unsigned_v<std::decay_t<decltype(value)>> && found->second.starts_with('-');
    if (!is_number || is_negative)
      throw InputError(name + ": " + key + " of the flight is not a number: " + found->second);
  });
  return arguments;
}

namespace {
Camera with_mount(Camera camera, const SourceArguments& arguments) {
  if (!arguments.mount.empty()) camera.T_body_camera = mount_from(arguments.mount);
  return camera;
}

void refuse_frames(const SourceArguments& arguments) {
  if (arguments.frames == 0) return;
  throw InputError("--frames " + std::to_string(arguments.frames) +
                   ": is for a simulated flight only; leave it out with a recording");
}

std::unique_ptr<FrameSource> open_live(const SourceArguments& arguments) {
  refuse_frames(arguments);
  if (!arguments.camera.empty())
    throw InputError("--camera " + arguments.camera + ": " + arguments.name +
                     " has its own calibration; leave it out");
  return open_live_camera(arguments.name, arguments.stream, arguments.mount);
}

std::unique_ptr<FrameSource> open_recorded(const SourceArguments& arguments) {
  refuse_frames(arguments);
  std::optional<Camera> camera;
  if (!arguments.camera.empty()) camera = load_camera(arguments.camera);
  std::optional<SE3> mount;
  if (!arguments.mount.empty()) mount = mount_from(arguments.mount);
  return std::make_unique<RecordingSource>(arguments.name, arguments.topics, camera, mount);
}

std::unique_ptr<FrameSource> open_other_dataset(const SourceArguments& arguments) {
  refuse_frames(arguments);
  std::optional<Camera> camera;
  if (!arguments.camera.empty()) camera = load_camera(arguments.camera);
  if (!arguments.mount.empty()) {
    // The mount is of the camera that the folder knows, if none is given.
    if (!camera) camera = open_dataset(arguments.name, std::nullopt, DatasetUse::kImages)->camera();
    camera->T_body_camera = mount_from(arguments.mount);
  }
  return open_dataset(arguments.name, camera);
}
}  // namespace

std::unique_ptr<TumSource> open_folder(const SourceArguments& arguments) {
  if (is_recorded(arguments.name))
    throw InputError(arguments.name + ": is a recording, and this needs a folder in the TUM RGB-D format");
  if (is_other_dataset(arguments.name))
    throw InputError(arguments.name + ": is in the format of " +
                     std::string(name_of(*dataset_format(arguments.name))) +
                     ", and this needs a folder in the TUM RGB-D format");
  if (arguments.camera.empty()) {
    throw InputError(
        arguments.name +
        ": needs --camera with a preset (tum-fr1 tum-fr2 tum-fr3 7scenes bonn d435 d455) or a file");
  }
  refuse_frames(arguments);
  return std::make_unique<TumSource>(arguments.name, with_mount(load_camera(arguments.camera), arguments));
}

std::unique_ptr<FrameSource> open_source(const SourceArguments& arguments) {
  std::unique_ptr<FrameSource> source;
  for_each_topic(arguments, [&](const char* /*name*/, const std::string& topic) {
    if (!topic.empty() && !is_recorded(arguments.name))
      throw InputError(topic + ": is a topic of a recording, and " + arguments.name +
                       " is none; leave it out");
  });
  if (!arguments.stream.empty() && !is_live_camera(arguments.name))
    throw InputError("--stream " + arguments.stream + ": is of a camera, and " + arguments.name +
                     " is none; leave it out");
  if (const auto flight = simulated_flight(arguments)) {
    source = std::make_unique<SimulatedSource>(*flight);
  } else if (is_live_camera(arguments.name)) {
    source = open_live(arguments);
  } else if (is_recorded(arguments.name)) {
    source = open_recorded(arguments);
  } else if (is_other_dataset(arguments.name)) {
    source = open_other_dataset(arguments);
  } else {
    source = open_folder(arguments);
  }
  const auto degradation = degradation_from(arguments.degrade).value_or(Degradation::kNone);
  if (degradation == Degradation::kNone) return source;
  return std::make_unique<DegradedSource>(std::move(source), degradation);
}

}  // namespace roslam::app
