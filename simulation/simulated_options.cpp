// SPDX-License-Identifier: BSD-3-Clause
#include "simulation/simulated_options.hpp"

#include <sstream>

#include "roslam/common/error.hpp"

namespace roslam::simulation {
namespace {

void check(const char* field, double value, double low, double high) {
  if (value >= low && value <= high) return;  // false for NaN too
  std::ostringstream message;
  message << "simulator: " << field << " is " << value << ", but must lie in " << low << " to " << high;
  throw OptionsError(message.str());
}

}  // namespace

std::optional<FlightPath> flight_path_from(std::string_view name) {
  if (name == "street") return FlightPath::kStreet;
  if (name == "loop") return FlightPath::kLoop;
  if (name == "hover") return FlightPath::kHover;
  if (name == "turn") return FlightPath::kTurn;
  if (name == "corridor") return FlightPath::kCorridor;
  return std::nullopt;
}

std::optional<TrafficLevel> traffic_level_from(std::string_view name) {
  if (name == "none") return TrafficLevel::kNone;
  if (name == "light") return TrafficLevel::kLight;
  if (name == "heavy") return TrafficLevel::kHeavy;
  return std::nullopt;
}

std::optional<DepthModel> depth_model_from(std::string_view name) {
  if (name == "ideal") return DepthModel::kIdeal;
  if (name == "d455") return DepthModel::kD455;
  return std::nullopt;
}

void SimulatorOptions::validate() const {
  check("fps", fps, 1, 1000);
  check("speed", speed, 0.01, 30);
  check("altitude", altitude, 2.2, 30);  // above people and cars
  check("aside", aside, -3, 3);          // between the houses
  check("gusts", gusts, 0, 3);
  check("gain", gain, 0.1, 10);
  check("pitch_down", pitch_down, -0.8, 1.58);
  check("sway", sway, 0, 5);
  check("baseline", baseline, 0.01, 2);
  check("colour_noise", colour_noise, 0, 50);
}

}  // namespace roslam::simulation
