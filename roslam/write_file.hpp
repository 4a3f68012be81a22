// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "roslam/error.hpp"

namespace roslam {

/// Writes all bytes to a file, replacing what it held. Throws OutputError if the file cannot be opened or
/// written in full; the flush is what makes a full disk show here instead of in a destructor that cannot
/// report it.
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

}  // namespace roslam
