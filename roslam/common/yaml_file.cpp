// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/common/yaml_file.hpp"

#include "roslam/common/error.hpp"

namespace roslam {

YAML::Node load_yaml(const std::filesystem::path& file, const std::string& if_missing) {
  // The parser opens a folder like a file and leaks memory when it cannot read it.
  if (std::filesystem::is_directory(file))
    throw InputError(file.string() + ": is a folder; give a YAML file");
  try {
    return YAML::LoadFile(file.string());
  } catch (const YAML::BadFile&) {
    throw InputError(file.string() + ": " + if_missing);
  } catch (const std::exception& error) {
    throw InputError(file.string() + ": not a valid YAML file: " + error.what());
  }
}

}  // namespace roslam
