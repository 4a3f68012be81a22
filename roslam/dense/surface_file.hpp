// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "roslam/common/export.hpp"
#include "roslam/dense/surface_map.hpp"

namespace roslam {

/// Writes a PLY file (binary, little-endian): x y z nx ny nz (float), red green blue label provenance
/// (uchar), and with_triangles the faces. Atomic: an existing file is replaced only by a complete one. Throws
/// OutputError.
ROSLAM_EXPORT void write_surface_ply(const std::filesystem::path& file, const SurfaceMap& surface,
                                     bool with_triangles);

/// Writes a PCD 0.7 file (binary): x y z rgb normal_x normal_y normal_z label provenance. Atomic and throws
/// as write_surface_ply.
ROSLAM_EXPORT void write_surface_pcd(const std::filesystem::path& file, const SurfaceMap& surface);

/// Reads the points and triangles of any PLY file (binary little-endian or ascii): x y z, and normals,
/// colours, label and provenance where present. Throws InputError naming the file and the fault.
ROSLAM_EXPORT SurfaceMap read_surface_ply(const std::filesystem::path& file);

}  // namespace roslam
