// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace roslam {

/// An OctoMap file with a validated tree: OctoMap itself does not check, and a damaged file can overflow its
/// stack.
struct OccupancyFile {
  double resolution = 0.0;         ///< metres
  bool has_probabilities = false;  ///< .ot, not .bt
  std::string nodes;               ///< the encoded tree, without the header; empty: no known cells
};

/// Throws InputError naming the file and what is wrong with it.
OccupancyFile read_occupancy_file(const std::filesystem::path& file);

/// The header of an OctoMap file, with the resolution (metres) in full precision. OctoMap's own writer keeps
/// six digits and prints to stderr.
std::string occupancy_header(bool has_probabilities, std::size_t nodes, double resolution);

/// Whether a cell side (metres) is allowed: 0.001 to 10.
bool is_occupancy_resolution(double resolution);

}  // namespace roslam
