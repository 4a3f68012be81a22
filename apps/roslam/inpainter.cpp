// SPDX-License-Identifier: BSD-3-Clause
#include "apps/roslam/inpainter.hpp"

#include <iostream>

namespace roslam::app {

std::shared_ptr<Inpainter> open_inpainter(const std::filesystem::path& folder) {
  const auto models = folder.empty() ? shipped_restoration_models() : folder;
  if (!models.empty()) return std::make_shared<GanInpainter>(models);
  std::cerr
      << "note: models/roslam-restorer-*.onnx: not found beside the program; what nobody saw is painted by a "
         "classic method. Install them or name their folder with --models\n";
  return nullptr;
}

}  // namespace roslam::app
