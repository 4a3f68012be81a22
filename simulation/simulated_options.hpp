// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace roslam::simulation {

enum class FlightPath {
  kStreet,    ///< 50 m along a street
  kLoop,      ///< around a block of houses, ending a few metres past the start
  kHover,     ///< two full turns on the spot
  kTurn,      ///< along a street, round a corner, along the next
  kCorridor,  ///< along a corridor with white walls and repeated tiles, and round its corner
};
enum class TrafficLevel { kNone, kLight, kHeavy };
enum class DepthModel {
  kIdeal,  ///< exact
  kD455,   ///< as an Intel RealSense D455 would measure it
};

// From the names used on the command line; nullopt for an unknown name.
std::optional<FlightPath> flight_path_from(std::string_view name);
std::optional<TrafficLevel> traffic_level_from(std::string_view name);
std::optional<DepthModel> depth_model_from(std::string_view name);

struct SimulatorOptions {
  FlightPath path = FlightPath::kStreet;
  TrafficLevel traffic = TrafficLevel::kLight;
  DepthModel depth = DepthModel::kD455;
  std::size_t frames = 0;     ///< number of frames; 0 or more than the flight has: the whole flight
  std::uint32_t seed = 1;     ///< of city, traffic, sway and noise
  double fps = 30.0;          ///< frames a second
  double speed = 1.0;         ///< of the flight, metres a second
  double altitude = 3.5;      ///< of the camera above the street, metres; in the corridor it is 1.5
  double aside = 0.0;         ///< lateral offset of the path, metres to the left; not in the corridor
  double pitch_down = 0.26;   ///< of the camera below the horizon, radians; in the corridor it is 0.1
  double sway = 1.0;          ///< of the drone; 1 is a few centimetres and about a degree, 0 none
  double gusts = 0.0;         ///< of wind; 1 turns the drone at up to 60 degrees a second, 0 is calm air
  bool stereo = false;        ///< frames are stereo pairs; a source gives no depth then
  double baseline = 0.12;     ///< of the pairs, metres
  bool imu = false;           ///< frames carry the samples of an inertial measurement unit
  double gain = 1.0;          ///< factor on the images' brightness, as under other lighting
  double colour_noise = 1.5;  ///< standard deviation, grey levels

  /// Throws OptionsError naming the field that is out of its range.
  void validate() const;
};

}  // namespace roslam::simulation
