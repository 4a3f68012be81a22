// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace roslam::app {

/// A file or run folder, and what a report calls it.
struct NamedPath {
  std::string name;
  std::filesystem::path path;
};

/// PATH or NAME=PATH; a file whose own name holds an equals sign goes before. A run of this program is told
/// by its folder, a file by its own name.
NamedPath parse_named(const std::string& argument);
std::vector<NamedPath> parse_named(const std::vector<std::string>& arguments);

/// Lines of a report that share a name could not be told apart: they are called by their paths.
void make_names_differ(const std::vector<std::vector<NamedPath>*>& lists);

}  // namespace roslam::app
