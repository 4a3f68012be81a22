// SPDX-License-Identifier: BSD-3-Clause
// In place of inference.cpp and pspnet_segmenter.cpp in a library without the component semantics.
#include "roslam/common/error.hpp"
#include "roslam/semantics/inference.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"

namespace roslam {

namespace {
constexpr const char* kAbsent = "this library was built without networks (ROSLAM_SEMANTICS)";
}

bool has_onnx_runtime() { return false; }

std::unique_ptr<Inference> load_inference(const std::filesystem::path& model, InferenceBackend) {
  throw ModelError(model.string() + ": " + kAbsent);
}

cv::Size working_size(const cv::Size& image, int) { return image; }

PspnetSegmenter::PspnetSegmenter(const std::filesystem::path& model, const SegmenterOptions&,
                                 InferenceBackend) {
  throw ModelError(model.string() + ": " + kAbsent);
}

Segmentation PspnetSegmenter::segment(const cv::Mat&) { throw ModelError(kAbsent); }

std::filesystem::path find_segmentation_model() { return {}; }

ModelError missing_segmentation_model() { return ModelError(kAbsent); }

}  // namespace roslam
