// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "roslam/places/vocabulary.hpp"
#include "roslam/sources/frame_source.hpp"
#include "roslam/sources/simulated_options.hpp"
#include "roslam/sources/tum_source.hpp"

namespace roslam::app {

struct SourceArguments {
  std::string name;               ///< a TUM folder or simulated:street|loop|hover|turn
  std::string camera;             ///< a preset or a file; not needed for a simulation
  std::string traffic = "light";  ///< of a simulation
  std::size_t frames = 0;         ///< of a simulation; 0 = the whole flight
  std::uint32_t seed = 1;         ///< of a simulation
  double speed = 1.0;             ///< of a simulation, metres a second
  double altitude = 3.5;          ///< of a simulation, metres
  double aside = 0.0;             ///< of a simulation, metres
  double gain = 1.0;              ///< of a simulation
};

/// Adds SOURCE and --camera to a command; the result is SOURCE.
CLI::Option* add_source_options(CLI::App& command, SourceArguments& arguments);

/// Adds what can be chosen of a simulated flight: --traffic, --frames, --seed and so on.
void add_flight_options(CLI::App& command, SourceArguments& arguments);

/// Opens what the user named. Throws InputError or CalibrationError.
std::unique_ptr<FrameSource> open_source(const SourceArguments& arguments);

/// What was chosen of a simulated flight, by the name of its option; empty for a recording.
std::map<std::string, std::string> flight_in_words(const SourceArguments& arguments);

/// The other way round; what words does not name keeps its default. Throws InputError for what is no number.
SourceArguments flight_from_words(const std::string& name, const std::map<std::string, std::string>& words);

/// The vocabulary in a file, or without a name the one that comes with the program; null if there is none.
std::shared_ptr<const Vocabulary> load_vocabulary(const std::string& file);

/// The two kinds of sources. The flight is empty if the user named a recording. Both throw as open_source.
std::optional<SimulatorOptions> simulated_flight(const SourceArguments& arguments);
std::unique_ptr<TumSource> open_recording(const SourceArguments& arguments);

}  // namespace roslam::app
