// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/sources.hpp"

#include "roslam/error.hpp"
#include "roslam/sources/tum_source.hpp"

namespace roslam::app {

std::unique_ptr<FrameSource> open_source(const std::string& name, const std::string& camera, std::uint64_t) {
  if (camera.empty()) {
    throw InputError(name + ": needs --camera with a preset (tum-fr1 tum-fr2 tum-fr3 7scenes d435 d455) or a file");
  }
  return std::make_unique<TumSource>(name, load_camera(camera));
}

}  // namespace roslam::app
