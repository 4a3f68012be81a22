// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "roslam/common/export.hpp"
#include "roslam/map/map.hpp"

namespace roslam {

/// Writes the landmarks of a submap as a coloured point cloud (binary little-endian PLY: float x y z in
/// metres in its world frame, uchar red green blue). Throws OutputError if it cannot be written in full.
ROSLAM_EXPORT void write_map_ply(const std::filesystem::path& file, const Map& map,
                                 SubmapId submap = SubmapId{0});

}  // namespace roslam
