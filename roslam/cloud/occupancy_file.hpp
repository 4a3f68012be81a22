// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace roslam {

/// An OctoMap file whose tree was checked: OctoMap itself believes a damaged file, until it has used up the
/// stack.
struct OccupancyFile {
  double resolution = 0.0;         ///< metres
  bool has_probabilities = false;  ///< .ot, not .bt
  std::string nodes;  ///< the tree as it is in the file, without the header; empty: no cell is known
};

/// Throws InputError naming the file and what is wrong with it.
OccupancyFile read_occupancy_file(const std::filesystem::path& file);

/// What an OctoMap file of so many nodes begins with. OctoMap's own has six digits of the resolution, and
/// says on stderr that it wrote.
std::string occupancy_header(bool has_probabilities, std::size_t nodes, double resolution);

/// Whether cells may have that side (metres).
bool is_occupancy_resolution(double resolution);

}  // namespace roslam
