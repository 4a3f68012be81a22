// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "roslam/common/export.hpp"
#include "roslam/map_io/saved_map.hpp"

namespace roslam {

/// Writes a map to one file (docs/map_format.md), which it replaces atomically. The ids of its keyframes
/// must be without gaps, as SavedMap::of makes them. Throws OutputError.
ROSLAM_EXPORT void save_map(const std::filesystem::path& file, const SavedMap& saved);

/// Reads such a file. Throws InputError naming what is wrong and the remedy.
ROSLAM_EXPORT SavedMap load_map(const std::filesystem::path& file);

/// Encodes and decodes the content of such a file, without its header; name: of the file, for messages.
ROSLAM_EXPORT std::string encode_map(const SavedMap& saved);
ROSLAM_EXPORT SavedMap decode_map(std::string_view content, const std::string& name);

}  // namespace roslam
