// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/map/map_ply.hpp"

#include <string>

#include "roslam/common/binary.hpp"
#include "roslam/common/write_file.hpp"

namespace roslam {

void write_map_ply(const std::filesystem::path& file, const Map& map, SubmapId submap) {
  auto ids = map.landmark_ids();
  std::erase_if(ids, [&](LandmarkId id) { return map.submap_of(*map.find(id)) != submap; });
  BinaryWriter writer;
  writer.put_bytes(
      "ply\nformat binary_little_endian 1.0\ncomment RO-SLAM sparse map, world frame, metres\nelement "
      "vertex " +
      std::to_string(ids.size()) +
      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nend_header\n");
  for (const LandmarkId id : ids) {
    const Landmark& landmark = *map.find(id);
    for (const double value : landmark.position) writer.put(static_cast<float>(value));
    for (int c = 2; c >= 0; --c) writer.put(landmark.colour[c]);
  }
  write_file(file, writer.bytes());
}

}  // namespace roslam
