// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/occupancy/occupancy_map.hpp"

#include "fuzz/fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace roslam;
  return fuzz::expect_result_or_error(data, size, [](std::string_view bytes) {
    const fuzz::MemoryFile file(bytes);
    const OccupancyMap read = OccupancyMap::read(file.path());
    OccupancyMap other(read.resolution());
    other.free_from(read);
  });
}
