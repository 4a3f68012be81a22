// SPDX-License-Identifier: BSD-3-Clause
// In place of inpainter.cpp in a library without the component semantics.
#include "roslam/common/error.hpp"
#include "roslam/restoration/inpainter.hpp"

namespace roslam {

GanInpainter::GanInpainter(const std::filesystem::path& folder, InferenceBackend) {
  throw ModelError(folder.string() + ": this library was built without networks (ROSLAM_SEMANTICS)");
}

cv::Mat GanInpainter::inpaint(const cv::Mat& crop, const cv::Mat&, const cv::Rect&, Movable) { return crop; }

std::filesystem::path find_restoration_models() { return {}; }

}  // namespace roslam
