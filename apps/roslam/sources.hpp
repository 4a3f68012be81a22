// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "roslam/sources/frame_source.hpp"

namespace roslam::app {

/// Opens what the user named: a TUM folder or simulated:street|loop|hover|turn. camera: a preset or a file; may be
/// empty for a simulation. Throws InputError or CalibrationError.
std::unique_ptr<FrameSource> open_source(const std::string& name, const std::string& camera, std::uint64_t seed);

}  // namespace roslam::app
