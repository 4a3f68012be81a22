// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string_view>
#include <system_error>

#include "roslam/common/error.hpp"
#include "roslam/common/export.hpp"

namespace roslam {

/// True for what is written directly, as it cannot be replaced: a device or a pipe.
ROSLAM_EXPORT bool is_device(const std::filesystem::path& file);

/// Writes a file in whole or not at all: writes a temporary file (.part) and renames it, so that the old
/// content stays until the new is complete. A device or pipe is written directly. Throws OutputError.
ROSLAM_EXPORT void write_file(const std::filesystem::path& file, std::string_view bytes);

/// The same, but flushes to the disk before renaming, so that a power cut costs neither the old nor the new.
ROSLAM_EXPORT void replace_file(const std::filesystem::path& file, std::string_view bytes);

/// Creates a folder and its missing parents. Throws OutputError if that fails.
inline void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder, error)) {
    throw OutputError(folder.string() + ": cannot create the output folder; choose another --out");
  }
}

}  // namespace roslam
