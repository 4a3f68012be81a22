// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <string>

#include "roslam/common/export.hpp"

namespace roslam {

/// Reads a YAML file. Throws InputError naming the file; if_missing: the message if it cannot be opened.
ROSLAM_EXPORT YAML::Node load_yaml(const std::filesystem::path& file, const std::string& if_missing);

}  // namespace roslam
