// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "roslam/restoration/inpainter.hpp"

namespace roslam::app {

/// The network that paints what nobody saw, from a folder or, without a name, as it comes with the program.
/// Null, and a note on stderr, if it did not come with it. Throws ModelError.
std::shared_ptr<Inpainter> open_inpainter(const std::filesystem::path& folder = {});

/// The same, where nothing else will do: throws ModelError if it is not there.
std::shared_ptr<Inpainter> require_inpainter(const std::filesystem::path& folder = {});

}  // namespace roslam::app
