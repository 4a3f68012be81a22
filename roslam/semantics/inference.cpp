// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/semantics/inference.hpp"

#include <fstream>
#include <iterator>
#include <opencv2/dnn.hpp>
#include <system_error>

#include "roslam/common/error.hpp"
#include "roslam/common/out_of_memory.hpp"

namespace roslam {

namespace {
constexpr std::uintmax_t kLargestModel = 256U << 20U;             // bytes; the one supplied has a few MB
constexpr const char* kRemedy = "choose a smaller working side";  // if memory runs out

std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

class OpenCvInference : public Inference {
 public:
  OpenCvInference(cv::dnn::Net net, std::filesystem::path model)
      : net_(std::move(net)), model_(std::move(model)) {
    net_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
    net_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  }

  cv::Mat run(const cv::Mat& input) override {
    try {
      net_.setInput(input);
      return net_.forward();
    } catch (const cv::Exception& error) {
      throw_if_out_of_memory(error, model_, kRemedy);
      throw ModelError(model_.string() + ": the network cannot be run (" + first_line(error.err) +
                       "); install the model that belongs to this version");
    }
  }

 private:
  cv::dnn::Net net_;
  std::filesystem::path model_;
};

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

std::unique_ptr<Inference> load_opencv_inference(const std::string& bytes,
                                                 const std::filesystem::path& model) {
  try {
    cv::dnn::Net net = cv::dnn::readNetFromONNX(bytes.data(), bytes.size());
    if (net.empty()) throw ModelError(model.string() + ": contains no network; install the model again");
    return std::make_unique<OpenCvInference>(std::move(net), model);
  } catch (const cv::Exception& error) {
    throw_if_out_of_memory(error, model, kRemedy);
    throw ModelError(model.string() + ": is damaged or not an ONNX network that OpenCV can run (" +
                     first_line(error.err) + "); install the model again");
  }
}

#ifndef ROSLAM_WITH_ONNX_RUNTIME
std::unique_ptr<Inference> load_onnx_runtime_inference(const std::string&,
                                                       const std::filesystem::path& model) {
  throw ModelError(model.string() +
                   ": this build has no ONNX Runtime; build with it installed or use the opencv backend");
}
#endif

bool has_onnx_runtime() {
#ifdef ROSLAM_WITH_ONNX_RUNTIME
  return true;
#else
  return false;
#endif
}

std::unique_ptr<Inference> load_inference(const std::filesystem::path& model, InferenceBackend backend) {
  const std::string bytes = read_model(model);
  if (backend == InferenceBackend::kOnnxRuntime ||
      (backend == InferenceBackend::kAutomatic && has_onnx_runtime())) {
    return load_onnx_runtime_inference(bytes, model);
  }
  return load_opencv_inference(bytes, model);
}

}  // namespace roslam
