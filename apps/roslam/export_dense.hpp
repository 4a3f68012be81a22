// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>

namespace roslam::app {

/// What is written of a dense map. Files without a name are not written.
struct DenseExport {
  std::filesystem::path ply;         ///< points
  std::filesystem::path mesh;        ///< points and triangles (PLY)
  std::filesystem::path pcd;         ///< points
  std::filesystem::path octomap;     ///< occupancy, .bt or .ot
  std::optional<double> resolution;  ///< metres, of occupancy
  bool no_invented = false;          ///< leave out points that nobody saw

  bool has_file() const { return !ply.empty() || !mesh.empty() || !pcd.empty() || !octomap.empty(); }

  /// Whether it asks for what only a dense map has.
  bool is_of_dense_only() const {
    return !mesh.empty() || !pcd.empty() || !octomap.empty() || resolution || no_invented;
  }
};

/// Whether a file is a dense map (PLY), by its name or its first bytes.
bool is_dense_map(const std::filesystem::path& file);

/// Writes a dense map in formats of other programs. Throws InputError if it has no points, or no triangles
/// and they are asked for, and OutputError.
void export_dense(const std::filesystem::path& map, const DenseExport& what);

}  // namespace roslam::app
