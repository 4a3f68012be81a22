// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "roslam/atlas/saved_map.hpp"

namespace roslam {

/// Writes a map to one file (docs/map_format.md), which it replaces whole or not at all. Its keyframes' ids
/// must be without gaps, as SavedMap::of makes them. Throws OutputError.
void save_map(const std::filesystem::path& file, const SavedMap& saved);

/// Reads such a file. Throws InputError naming what is wrong and the remedy.
SavedMap load_map(const std::filesystem::path& file);

/// The content of such a file, behind its header, and back; name: of the file, for messages.
std::string encode_map(const SavedMap& saved);
SavedMap decode_map(std::string_view content, const std::string& name);

}  // namespace roslam
