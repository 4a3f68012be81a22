// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "recording/recorded_run.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam::app {

/// Opens the source that a run was made from, from its first frame, with the camera of the run. Throws
/// InputError or CalibrationError, also for one that is not there any more.
std::unique_ptr<FrameSource> open_source_of(const recording::RunSource& run);

}  // namespace roslam::app
