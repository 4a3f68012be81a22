// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "roslam/datasets/tum_source.hpp"
#include "roslam/ros/recording_streams.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "simulation/simulated_options.hpp"

namespace roslam::app {

struct SourceArguments {
  std::string name;    ///< a folder, a recording, realsense[:SERIAL] or simulated:street|loop|hover|turn
  std::string camera;  ///< a preset or a file; not needed where the source knows it
  RecordingChoice topics = {};  ///< of a recording
  std::string stream = {};      ///< of a camera that is connected; empty: the usual one
  std::string mount = {};  ///< of the camera on the drone: X,Y,Z,ROLL,PITCH,YAW; empty: as the camera file
  std::string traffic = "light";  ///< the rest: of a simulated flight; none, light, heavy
  std::size_t frames = 0;         ///< 0 = the whole flight
  std::uint32_t seed = 1;
  double speed = 1.0;            ///< m/s
  double altitude = 3.5;         ///< metres above the street
  double aside = 0.0;            ///< metres to the left of the default path
  double fps = 30.0;             ///< frames a second
  bool imu = false;              ///< a simulated flight has inertial samples
  bool stereo = false;           ///< a simulated flight has stereo pairs in place of depth
  double gusts = 0.0;            ///< of wind; 1 turns the drone at up to 60 degrees a second
  double gain = 1.0;             ///< factor of the image brightness
  std::string degrade = "none";  ///< a name of simulation::degradation_names(), of any source
};

/// Adds SOURCE and --camera to a command; returns the option SOURCE.
CLI::Option* add_source_options(CLI::App& command, SourceArguments& arguments);

/// Adds the options of simulated flights: --traffic, --frames, --seed and so on.
void add_flight_options(CLI::App& command, SourceArguments& arguments);

/// Adds --colour, --depth and --truth, which choose topics of a recording; --imu is of the flight options.
void add_topic_options(CLI::App& command, SourceArguments& arguments);

/// Adds --stream, of a camera that is connected.
void add_stream_option(CLI::App& command, SourceArguments& arguments);

/// Adds --mount.
void add_mount_option(CLI::App& command, SourceArguments& arguments);

/// Adds --degrade.
void add_degrade_option(CLI::App& command, SourceArguments& arguments);

/// Opens the source. Throws InputError or CalibrationError.
std::unique_ptr<FrameSource> open_source(const SourceArguments& arguments);

/// The options of a simulated flight, or the topics that were chosen of a recording, as text, by name.
std::map<std::string, std::string> flight_in_words(const SourceArguments& arguments);

/// The inverse; an option not in words keeps its default. Throws InputError for a value that is no number.
SourceArguments flight_from_words(const std::string& name, const std::map<std::string, std::string>& words);

/// Where no SOURCE was given before --imu, its value was meant as that. To be called before the arguments are
/// used.
void settle_imu(SourceArguments& arguments);

/// True for a recording of a robot (ROS bag, rosbag2, MCAP). A folder of a dataset may hold such files as
/// well.
bool is_recorded(const std::string& name);

/// True for a folder in another format than TUM RGB-D with its lists.
bool is_other_dataset(const std::string& name);

/// Kinds of sources; the flight is empty for others, and the folder must be in the TUM RGB-D format. All
/// throw as open_source().
std::optional<simulation::SimulatorOptions> simulated_flight(const SourceArguments& arguments);
std::unique_ptr<TumSource> open_folder(const SourceArguments& arguments);

}  // namespace roslam::app
