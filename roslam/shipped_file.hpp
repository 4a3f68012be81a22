// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string_view>
#include <system_error>

namespace roslam {

/// A file of models/ that comes with the program, in the build tree or where it is installed; empty if there
/// is none of that name.
inline std::filesystem::path shipped_file(std::string_view name) {
  std::error_code error;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const char* models :
       {"models", "../models", "../../models", "../../../models", "../share/roslam/models"}) {
    const auto file = folder / models / name;
    if (std::filesystem::is_regular_file(file, error)) return file.lexically_normal();
  }
  return {};
}

}  // namespace roslam
