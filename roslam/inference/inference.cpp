// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/inference/inference.hpp"

#include <fstream>
#include <iterator>
#include <system_error>

#include "roslam/common/error.hpp"
#include "roslam/inference/image_planes.hpp"
#include "roslam/inference/score_grid.hpp"

namespace roslam {

namespace {
constexpr std::uintmax_t kLargestModel = 256U << 20U;  // bytes; the one supplied has a few MB

std::string read_model(const std::filesystem::path& model) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(model, error)) {
    throw ModelError(model.string() + ": no such model file; expected the weights as an ONNX file");
  }
  if (std::filesystem::file_size(model, error) > kLargestModel || error) {
    throw ModelError(model.string() + ": larger than 256 MB; give an ONNX file made by training/");
  }
  std::ifstream in(model, std::ios::binary);
  std::string bytes(std::istreambuf_iterator<char>(in), {});
  if (!in && !in.eof()) throw ModelError(model.string() + ": cannot be read; check its permissions");
  if (bytes.empty()) throw ModelError(model.string() + ": is empty; install the model again");
  return bytes;
}
}  // namespace

ScoreGrid Inference::scores(const cv::Mat& image) {
  const int size[] = {1, 3, image.rows, image.cols};
  blob_.create(4, size, CV_32F);
  write_rgb_planes(image, blob_);
  return ScoreGrid::from_planes(run(blob_));
}

bool has_onnx_runtime() {
#ifdef ROSLAM_WITH_ONNX_RUNTIME
  return true;
#else
  return false;
#endif
}

bool has_opencv_dnn() {
#ifdef ROSLAM_WITH_OPENCV_DNN
  return true;
#else
  return false;
#endif
}

#ifndef ROSLAM_WITH_ONNX_RUNTIME
std::unique_ptr<Inference> load_onnx_runtime_inference(const std::string&,
                                                       const std::filesystem::path& model) {
  throw ModelError(model.string() +
                   ": this build has no ONNX Runtime; build with it installed or use another backend");
}
#endif

#ifndef ROSLAM_WITH_OPENCV_DNN
std::unique_ptr<Inference> load_opencv_inference(const std::string&, const std::filesystem::path& model) {
  throw ModelError(
      model.string() +
      ": this build has no dnn module of OpenCV; build with it installed or use another backend");
}
#endif

std::unique_ptr<Inference> load_inference(const std::filesystem::path& model, InferenceBackend backend,
                                          int threads) {
  const std::string bytes = read_model(model);
  std::string why_not_own;
  if (backend == InferenceBackend::kOwn) return load_own_inference(bytes, model, threads);
  if (backend == InferenceBackend::kAutomatic) {
    try {
      return load_own_inference(bytes, model, threads);
    } catch (const ModelError& error) {
      if (!has_onnx_runtime() && !has_opencv_dnn()) throw;
      why_not_own = error.what();
    }
  }
  const bool by_runtime = backend == InferenceBackend::kOnnxRuntime ||
                          (backend == InferenceBackend::kAutomatic && has_onnx_runtime());
  auto inference =
      by_runtime ? load_onnx_runtime_inference(bytes, model) : load_opencv_inference(bytes, model);
  if (!why_not_own.empty()) inference->set_note(why_not_own + "; it runs with " + inference->backend());
  return inference;
}

}  // namespace roslam
