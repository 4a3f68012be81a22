// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/inpainter.hpp"

#include <iostream>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam::app {

namespace {
constexpr const char* kMissing = "models/roslam-restorer-*.onnx: not found beside the program";
constexpr const char* kRemedy = "install them or name their folder with --models";

std::shared_ptr<Inpainter> inpainter_in(const std::filesystem::path& folder) {
  const auto models = folder.empty() ? find_restoration_models() : folder;
  return models.empty() ? nullptr : std::make_shared<GanInpainter>(models);
}
}  // namespace

std::shared_ptr<Inpainter> open_inpainter(const std::filesystem::path& folder) {
  auto inpainter = inpainter_in(folder);
  if (!inpainter)
    std::cerr << "note: " << kMissing << "; a classic method inpaints pixels that no image shows; " << kRemedy
              << "\n";
  return inpainter;
}

std::shared_ptr<Inpainter> require_inpainter(const std::filesystem::path& folder) {
  auto inpainter = inpainter_in(folder);
  if (!inpainter) throw ModelError(std::string(kMissing) + "; " + kRemedy);
  return inpainter;
}

}  // namespace roslam::app
