// SPDX-License-Identifier: BSD-3-Clause
#include <cstdlib>

#include "fuzz/fuzz.hpp"
#include "roslam/dense/surface_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roslam;
  return fuzz::expect_result_or_error(data, size, [](std::string_view bytes) {
    const fuzz::MemoryFile file(bytes);
    const SurfaceMap surface = read_surface_ply(file.path());
    for (const auto& triangle : surface.triangles)
      for (const std::uint32_t corner : triangle)
        if (corner >= surface.points.size()) std::abort();
  });
}
