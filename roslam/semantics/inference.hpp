// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "roslam/common/export.hpp"
#include "roslam/semantics/segmenter_options.hpp"

namespace roslam {

/// Runs a network with one input and one output. Not thread safe.
class ROSLAM_EXPORT Inference {
 public:
  Inference() = default;
  Inference(const Inference&) = delete;
  Inference& operator=(const Inference&) = delete;
  virtual ~Inference() = default;

  /// input: CV_32F, 1 x 3 x height x width. Returns CV_32F, 1 x channels x height' x width'; its memory may
  /// be reused by the next call. Throws ModelError.
  virtual cv::Mat run(const cv::Mat& input) = 0;
};

/// True if the library was built with ONNX Runtime.
ROSLAM_EXPORT bool has_onnx_runtime();

/// Loads an ONNX file. Throws ModelError naming the file if it is missing or not a network the backend can
/// run, or if the backend is not available.
ROSLAM_EXPORT std::unique_ptr<Inference> load_inference(
    const std::filesystem::path& model, InferenceBackend backend = InferenceBackend::kAutomatic);

// The individual backends; bytes: the file's content, model: its name for messages.
ROSLAM_EXPORT std::unique_ptr<Inference> load_opencv_inference(const std::string& bytes,
                                                               const std::filesystem::path& model);
ROSLAM_EXPORT std::unique_ptr<Inference> load_onnx_runtime_inference(const std::string& bytes,
                                                                     const std::filesystem::path& model);

}  // namespace roslam
