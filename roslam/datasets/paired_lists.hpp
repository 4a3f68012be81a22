// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "roslam/datasets/folder_source.hpp"
#include "roslam/sensors/timed_files.hpp"

namespace roslam::datasets {

/// A list of pairs: lines "time file time file", e.g. associations.txt.
struct PairedList {
  std::filesystem::path list;
  TimedFileList colour;
  std::vector<std::filesystem::path> depth;  ///< of each entry of colour
};

/// The list of pairs of a folder: associations.txt, associated.txt or assoc*.txt; nothing if it has none.
std::optional<std::filesystem::path> find_paired_list(const std::filesystem::path& folder);

/// Reads it. Either column may be the colour images: the depth images are those whose name says so, or else
/// those of 16 bits. Throws InputError if a line is malformed or no image is named.
PairedList read_paired_list(const std::filesystem::path& list);

/// Adds the frames of a list of pairs, in order of time. Returns the unit of its times in seconds.
double list_pairs(PairedList pairs, FolderListing& listing);

/// Adds the frames of two lists, pairing what is nearest in time. Returns the unit of the times in seconds.
double list_by_time(const std::filesystem::path& colour, const std::filesystem::path& depth,
                    double max_time_difference, FolderListing& listing);

}  // namespace roslam::datasets
