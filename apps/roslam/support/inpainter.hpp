// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>

#include "roslam/restoration/inpainter.hpp"

namespace roslam::app {

/// Loads the inpainting network from a folder, or the shipped one if the name is empty. Null, with a note on
/// stderr, if there is no shipped one. Throws ModelError.
std::shared_ptr<Inpainter> open_inpainter(const std::filesystem::path& folder = {},
                                          InferenceBackend backend = InferenceBackend::kAutomatic);

/// The same, but throws ModelError if there is no shipped one.
std::shared_ptr<Inpainter> require_inpainter(const std::filesystem::path& folder = {},
                                             InferenceBackend backend = InferenceBackend::kAutomatic);

}  // namespace roslam::app
