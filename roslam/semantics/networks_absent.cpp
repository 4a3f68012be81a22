// SPDX-License-Identifier: BSD-3-Clause
// In place of inference.cpp and pspnet_segmenter.cpp in a library without the component semantics.
#include "roslam/common/error.hpp"
#include "roslam/inference/inference.hpp"
#include "roslam/inference/score_grid.hpp"
#include "roslam/semantics/pspnet_segmenter.hpp"

namespace roslam {

namespace {
constexpr const char* kAbsent = "this library was built without networks (ROSLAM_SEMANTICS)";
}

ScoreGrid Inference::scores(const cv::Mat&) { throw ModelError(kAbsent); }

bool has_onnx_runtime() { return false; }

bool has_opencv_dnn() { return false; }

std::string own_instruction_set() { return {}; }

std::unique_ptr<Inference> load_inference(const std::filesystem::path& model, InferenceBackend, int) {
  throw ModelError(model.string() + ": " + kAbsent);
}

cv::Size working_size(const cv::Size& image, int) { return image; }

PspnetSegmenter::PspnetSegmenter(const std::filesystem::path& model, const SegmenterOptions&,
                                 InferenceBackend) {
  throw ModelError(model.string() + ": " + kAbsent);
}

Segmentation PspnetSegmenter::segment(const cv::Mat&) { throw ModelError(kAbsent); }

std::string PspnetSegmenter::backend() const { return {}; }

std::string PspnetSegmenter::note() const { return {}; }

std::filesystem::path find_segmentation_model() { return {}; }

ModelError missing_segmentation_model() { return ModelError(kAbsent); }

}  // namespace roslam
