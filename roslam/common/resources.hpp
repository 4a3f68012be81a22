// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string_view>

#include "roslam/common/export.hpp"

namespace roslam {

/// A file of models/ that comes with RO-SLAM: the weights of the networks, the vocabulary. Looked for in the
/// folders of the environment variable ROSLAM_MODEL_PATH (separated by colons), then relative to the library
/// or program that this code is linked into (build tree, install prefix), then in the prefix it was
/// configured with. Empty if there is none of that name.
ROSLAM_EXPORT std::filesystem::path find_resource(std::string_view name);

}  // namespace roslam
