// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

namespace roslam::app {

/// The files to write of a dense map; those with an empty name are not written.
struct DenseExport {
  std::filesystem::path ply;         ///< points
  std::filesystem::path mesh;        ///< points and triangles (PLY)
  std::filesystem::path pcd;         ///< points
  std::filesystem::path octomap;     ///< occupancy, .bt or .ot
  std::optional<double> resolution;  ///< metres, of occupancy
  bool no_inpainted = false;         ///< leave out inpainted points

  bool has_file() const { return !ply.empty() || !mesh.empty() || !pcd.empty() || !octomap.empty(); }

  /// Whether it asks for something that only a dense map has.
  bool is_of_dense_only() const {
    return !mesh.empty() || !pcd.empty() || !octomap.empty() || resolution || no_inpainted;
  }
};

/// Whether a file is a dense map (PLY), by its extension or its first bytes.
bool is_dense_map(const std::filesystem::path& file);

/// Writes a dense map in other file formats. Throws InputError if it has no points, or no triangles where
/// what.mesh is set, and OutputError.
void export_dense(const std::filesystem::path& map, const DenseExport& what);

}  // namespace roslam::app
