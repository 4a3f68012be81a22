// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/camera.hpp"

#include "fuzz/fuzz.hpp"
#include "roslam/geometry/camera_export.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roslam;
  return fuzz::expect_result_or_error(data, size, [](std::string_view bytes) {
    const fuzz::MemoryFile file(bytes);
    const Camera camera = read_camera(file.path());
    camera.validate();
    camera_to_ros(camera);
    camera_to_opencv(camera);
    camera_to_kalibr(camera);  // last, as it refuses some lenses
  });
}
