// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "roslam/sources/frame_source.hpp"

namespace roslam::app {

struct SourceArguments {
  std::string name;               ///< a TUM folder or simulated:street|loop|hover|turn
  std::string camera;             ///< a preset or a file; not needed for a simulation
  std::string traffic = "light";  ///< of a simulation
  std::size_t frames = 0;         ///< of a simulation; 0 = the whole flight
  std::uint32_t seed = 1;         ///< of a simulation
};

/// Opens what the user named. Throws InputError or CalibrationError.
std::unique_ptr<FrameSource> open_source(const SourceArguments& arguments);

}  // namespace roslam::app
