// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/named_path.hpp"

#include <map>

#include "roslam/common/error.hpp"

namespace roslam::app {

namespace {
namespace fs = std::filesystem;

std::string short_name(const fs::path& given) {
  const fs::path path = fs::absolute(given).lexically_normal();
  const fs::path whole = path.has_filename() ? path : path.parent_path();
  if (fs::is_directory(given)) return whole.filename().string();
  return whole.filename() == "trajectory.txt" ? whole.parent_path().filename().string()
                                              : whole.stem().string();
}
}  // namespace

NamedPath parse_named(const std::string& argument) {
  const auto equals = argument.find('=');
  if (equals == std::string::npos || equals == 0 || fs::exists(argument))
    return {short_name(argument), argument};
  return {argument.substr(0, equals), argument.substr(equals + 1)};
}

std::vector<NamedPath> parse_named(const std::vector<std::string>& arguments) {
  std::vector<NamedPath> all;
  all.reserve(arguments.size());
  for (const auto& argument : arguments) all.push_back(parse_named(argument));
  return all;
}

fs::path file_in(const fs::path& path, const std::vector<std::string>& names, const std::string& remedy) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return path;
  std::string wanted;
  for (const auto& name : names) {
    if (fs::exists(path / name, error)) return path / name;
    wanted += (wanted.empty() ? "" : " or ") + name;
  }
  throw InputError(path.string() + ": the folder holds no " + wanted + "; " + remedy);
}

fs::path map_file(const fs::path& path) {
  return file_in(path, {"map.roslam"}, "give a map file or the folder of a run that was not --localise-only");
}

void make_names_unique(const std::vector<std::vector<NamedPath>*>& lists) {
  std::map<std::string, int> count;
  for (const auto* list : lists) {
    for (const auto& named : *list) ++count[named.name];
  }
  for (auto* list : lists) {
    for (auto& named : *list) {
      if (count[named.name] > 1) named.name = named.path.string();
    }
  }
}

}  // namespace roslam::app
