// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace roslam::app {

/// A file or run folder, and its name in a report.
struct NamedPath {
  std::string name;
  std::filesystem::path path;
};

/// Parses PATH or NAME=PATH; an existing file whose name contains an equals sign takes precedence. The
/// default name is that of the folder for a run, else that of the file.
NamedPath parse_named(const std::string& argument);
std::vector<NamedPath> parse_named(const std::vector<std::string>& arguments);

/// The first of these files that is in a folder, such as that of a run; a path that is no folder is returned
/// as it is. Throws InputError with the remedy if the folder has none of them.
std::filesystem::path file_in(const std::filesystem::path& path, const std::vector<std::string>& names,
                              const std::string& remedy);

/// A map file, given by its name or by the folder of the run that wrote it. Throws InputError.
std::filesystem::path map_file(const std::filesystem::path& path);

/// Replaces names that occur more than once by the paths.
void make_names_unique(const std::vector<std::vector<NamedPath>*>& lists);

}  // namespace roslam::app
