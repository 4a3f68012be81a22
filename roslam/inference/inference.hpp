// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "roslam/common/export.hpp"

namespace roslam {

/// What runs a network.
enum class InferenceBackend {
  kAutomatic,   ///< the own engine where it has all layers, else ONNX Runtime, else OpenCV
  kOwn,         ///< kernels for networks of the family of roslam-pspnet and roslam-restorer
  kOpenCv,      ///< OpenCV's dnn module
  kOnnxRuntime  ///< ONNX Runtime, optional
};

struct ScoreGrid;

/// Runs a network with one input and one output. Not thread safe.
class ROSLAM_EXPORT Inference {
 public:
  Inference() = default;
  Inference(const Inference&) = delete;
  Inference& operator=(const Inference&) = delete;
  virtual ~Inference() = default;

  /// input: CV_32F, 1 x channels x height x width. Returns CV_32F, 1 x channels x height' x width'; its
  /// memory may be reused by the next call. Throws ModelError, MemoryError.
  virtual cv::Mat run(const cv::Mat& input) = 0;

  /// The scores of a segmentation network for an image. image: CV_8UC3 (BGR). Throws as run() does, and
  /// ModelError if the network outputs something else.
  virtual ScoreGrid scores(const cv::Mat& image);

  /// What runs the network, such as "own (AVX2)" or "opencv 4.6.0".
  virtual std::string backend() const = 0;

  /// Why this is not the backend that would have been faster, for the user; empty if it is.
  const std::string& note() const { return note_; }
  void set_note(std::string note) { note_ = std::move(note); }

 private:
  std::string note_;
  cv::Mat blob_;  // reused between calls
};

/// True if the library was built with ONNX Runtime, with OpenCV's dnn module.
ROSLAM_EXPORT bool has_onnx_runtime();
ROSLAM_EXPORT bool has_opencv_dnn();

/// Name of the own engine's instruction set on this processor, such as "AVX2"; empty if it cannot run.
ROSLAM_EXPORT std::string own_instruction_set();

/// Loads an ONNX file. kAutomatic: the own engine if it has all layers and the processor fused multiply-adds,
/// else ONNX Runtime, else OpenCV. threads: of the own engine. Throws ModelError naming the file if it is
/// missing or not a network the backend can run, or if the backend is not available.
ROSLAM_EXPORT std::unique_ptr<Inference> load_inference(
    const std::filesystem::path& model, InferenceBackend backend = InferenceBackend::kAutomatic,
    int threads = 1);

// The individual backends; bytes: the file's content, model: its name for messages.
ROSLAM_EXPORT std::unique_ptr<Inference> load_own_inference(const std::string& bytes,
                                                            const std::filesystem::path& model, int threads);
ROSLAM_EXPORT std::unique_ptr<Inference> load_opencv_inference(const std::string& bytes,
                                                               const std::filesystem::path& model);
ROSLAM_EXPORT std::unique_ptr<Inference> load_onnx_runtime_inference(const std::string& bytes,
                                                                     const std::filesystem::path& model);

}  // namespace roslam
