// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/support/inpainter.hpp"

#include <iostream>
#include <string>

#include "roslam/common/error.hpp"

namespace roslam::app {

namespace {
constexpr const char* kMissing = "models/roslam-restorer-*.onnx: not found beside the program";
constexpr const char* kRemedy = "install them or name their folder with --models";
}  // namespace

std::shared_ptr<Inpainter> open_inpainter(const std::filesystem::path& folder, InferenceBackend backend) {
  auto inpainter = roslam::open_inpainter(folder, backend);
  if (!inpainter)
    std::cerr << "note: " << kMissing << "; a classic method inpaints pixels that no image shows; " << kRemedy
              << "\n";
  if (inpainter && !inpainter->note().empty()) std::cerr << "note: " << inpainter->note() << "\n";
  return inpainter;
}

std::shared_ptr<Inpainter> require_inpainter(const std::filesystem::path& folder, InferenceBackend backend) {
  auto inpainter = roslam::open_inpainter(folder, backend);
  if (!inpainter) throw ModelError(std::string(kMissing) + "; " + kRemedy);
  return inpainter;
}

}  // namespace roslam::app
