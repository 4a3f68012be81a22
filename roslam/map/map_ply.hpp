// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "roslam/map/map.hpp"

namespace roslam {

/// Writes the landmarks of a world as a coloured point cloud (binary little-endian PLY: float x y z in metres
/// in the world frame, uchar red green blue). Throws OutputError if the file cannot be written in full.
void write_map_ply(const std::filesystem::path& file, const Map& map, WorldId world = WorldId{0});

}  // namespace roslam
