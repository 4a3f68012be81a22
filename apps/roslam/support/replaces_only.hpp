// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace roslam::app {

/// For an option that names a file to write: refuses one that exists and does not begin as the files do that
/// the command writes, so that a mistyped name costs no file of another kind. An empty file may be replaced.
class ReplacesOnly : public CLI::Validator {
 public:
  explicit ReplacesOnly(std::vector<std::string> beginnings) : Validator("") {
    func_ = [beginnings = std::move(beginnings)](const std::string& file) -> std::string {
      std::error_code error;
      if (!std::filesystem::is_regular_file(file, error) || std::filesystem::file_size(file, error) == 0)
        return {};
      std::string begin(16, '\0');
      std::ifstream(file, std::ios::binary).read(begin.data(), static_cast<std::streamsize>(begin.size()));
      const bool is_same_kind = std::any_of(beginnings.begin(), beginnings.end(),
                                            [&](const std::string& kind) { return begin.starts_with(kind); });
      return is_same_kind ? std::string()
                          : file + ": exists and is a file of another kind; choose another name or remove it";
    };
  }
};

inline ReplacesOnly replaces_only_images() { return ReplacesOnly({"\x89PNG", "\xff\xd8"}); }

}  // namespace roslam::app
