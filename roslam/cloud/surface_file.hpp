// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "roslam/cloud/surface.hpp"

namespace roslam {

/// Writes points as PLY (binary, little-endian): x y z nx ny nz (float), red green blue label provenance
/// (uchar); with_triangles: and faces. A file that was there stays until the new one is whole. Throws
/// OutputError.
void write_surface_ply(const std::filesystem::path& file, const Surface& surface, bool with_triangles);

/// Writes points as PCD 0.7 (binary): x y z rgb normal_x normal_y normal_z label provenance. Throws
/// OutputError as write_surface_ply does.
void write_surface_pcd(const std::filesystem::path& file, const Surface& surface);

/// Reads the points and triangles of a PLY file, ours or another's (binary little-endian or ascii): x y z,
/// and of normals, colours, label and provenance what it has. Throws InputError naming the file and what is
/// wrong with it.
Surface read_surface_ply(const std::filesystem::path& file);

}  // namespace roslam
