// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "roslam/cameras/depth_camera.hpp"
#include "roslam/common/export.hpp"

namespace roslam {

/// Whether this library was built with librealsense (ROSLAM_REALSENSE).
ROSLAM_EXPORT bool has_realsense();

/// The Intel RealSense cameras that are connected (D400 series). Throws InputError if this library was built
/// without librealsense, or it does not work.
ROSLAM_EXPORT std::unique_ptr<DepthCamera> realsense_camera();

}  // namespace roslam
