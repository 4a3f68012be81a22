// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/sources.hpp"

#include <string>

#include "roslam/error.hpp"
#include "roslam/sources/simulated_source.hpp"
#include "roslam/sources/tum_source.hpp"

namespace roslam::app {

namespace {
constexpr std::string_view kSimulated = "simulated:";

std::unique_ptr<FrameSource> open_simulation(const SourceArguments& arguments) {
  const auto path = flight_path_from(arguments.name.substr(kSimulated.size()));
  const auto traffic = traffic_level_from(arguments.traffic);
  if (!path)
    throw InputError(arguments.name + ": no such flight; use simulated:street, :loop, :hover or :turn");
  if (!traffic) throw InputError("--traffic " + arguments.traffic + ": use none, light or heavy");
  if (!arguments.camera.empty() && arguments.camera != "simulated") {
    throw InputError("--camera " + arguments.camera +
                     ": a simulated flight brings its own camera; leave it out");
  }
  SimulatorOptions options;
  options.path = *path;
  options.traffic = *traffic;
  options.frames = arguments.frames;
  options.seed = arguments.seed;
  return std::make_unique<SimulatedSource>(options);
}
}  // namespace

std::unique_ptr<FrameSource> open_source(const SourceArguments& arguments) {
  if (arguments.name.starts_with(kSimulated)) return open_simulation(arguments);
  if (arguments.camera.empty()) {
    throw InputError(arguments.name +
                     ": needs --camera with a preset (tum-fr1 tum-fr2 tum-fr3 7scenes d435 d455) or a file");
  }
  if (arguments.frames != 0) {
    throw InputError("--frames " + std::to_string(arguments.frames) +
                     ": is for a simulated flight only; leave it out with a recording");
  }
  return std::make_unique<TumSource>(arguments.name, load_camera(arguments.camera));
}

}  // namespace roslam::app
