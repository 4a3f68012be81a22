// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cameras/realsense_camera.hpp"

namespace roslam {

bool has_realsense() { return false; }

std::unique_ptr<DepthCamera> realsense_camera() {
  throw InputError(
      "realsense: this program was built without librealsense; install librealsense2-dev and build again "
      "(docs/live.md)");
}

}  // namespace roslam
