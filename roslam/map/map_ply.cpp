// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/map/map_ply.hpp"

#include <bit>
#include <cstring>
#include <sstream>

#include "roslam/common/write_file.hpp"

namespace roslam {

void write_map_ply(const std::filesystem::path& file, const Map& map, SubmapId submap) {
  static_assert(std::endian::native == std::endian::little, "the PLY header promises little-endian values");
  std::ostringstream out;
  auto ids = map.landmark_ids();
  std::erase_if(ids, [&](LandmarkId id) { return map.submap_of(*map.find(id)) != submap; });
  out << "ply\nformat binary_little_endian 1.0\ncomment RO-SLAM sparse map, world frame, metres\n"
      << "element vertex " << ids.size() << "\n"
      << "property float x\nproperty float y\nproperty float z\n"
      << "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n";
  for (const LandmarkId id : ids) {
    const Landmark& landmark = *map.find(id);
    const Eigen::Vector3f position = landmark.position.cast<float>();
    char record[15];
    std::memcpy(record, position.data(), 12);
    for (int c = 0; c < 3; ++c) record[12 + c] = static_cast<char>(landmark.colour[2 - c]);
    out.write(record, sizeof(record));
  }
  write_file(file, out.str());
}

}  // namespace roslam
