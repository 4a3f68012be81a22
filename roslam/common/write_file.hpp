// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>

#include "roslam/common/error.hpp"

namespace roslam {

/// Writes all bytes to a file, replacing what it held. Throws OutputError if the file cannot be opened or
/// written in full. The explicit flush detects a full disk, which the destructor could not report.
inline void write_file(const std::filesystem::path& file, std::string_view bytes) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  if (!out) {
    throw OutputError(file.string() +
                      ": cannot open for writing; check that its folder exists and is writable");
  }
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.flush();
  if (!out)
    throw OutputError(file.string() + ": cannot be written in full; check the free space on the disk");
}

/// Replaces a file atomically: writes a temporary file (.part), flushes it to disk and renames it, so that
/// the old content stays until the new is complete. Throws OutputError.
void replace_file(const std::filesystem::path& file, std::string_view bytes);

/// Creates a folder and its missing parents. Throws OutputError if that fails.
inline void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error || !std::filesystem::is_directory(folder, error)) {
    throw OutputError(folder.string() + ": cannot create the output folder; choose another --out");
  }
}

}  // namespace roslam
