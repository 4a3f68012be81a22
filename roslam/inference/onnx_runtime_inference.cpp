// SPDX-License-Identifier: BSD-3-Clause
#include <onnxruntime_cxx_api.h>

#include <array>
#include <vector>

#include "roslam/common/error.hpp"
#include "roslam/inference/inference.hpp"
#include "roslam/inference/plan/onnx_image_size.hpp"

namespace roslam {

namespace {
Ort::SessionOptions single_threaded() {
  Ort::SessionOptions options;
  options.SetIntraOpNumThreads(1);
  options.SetInterOpNumThreads(1);
  options.SetLogSeverityLevel(ORT_LOGGING_LEVEL_FATAL);  // failures are thrown, and reported once
  return options;
}

class OnnxRuntimeInference : public Inference {
 public:
  OnnxRuntimeInference(const std::string& bytes, std::filesystem::path model)
      : model_(std::move(model)),
        environment_(ORT_LOGGING_LEVEL_FATAL, "roslam"),
        session_(environment_, bytes.data(), bytes.size(), single_threaded()) {
    if (session_.GetInputCount() != 1 || session_.GetOutputCount() != 1) {
      throw ModelError(model_.string() +
                       ": does not have one input and one output; install the model of this version");
    }
    const Ort::AllocatorWithDefaultOptions allocator;
    input_name_ = session_.GetInputNameAllocated(0, allocator).get();
    output_name_ = session_.GetOutputNameAllocated(0, allocator).get();
  }

  cv::Mat run(const cv::Mat& input) override {
    try {
      const std::array<std::int64_t, 4> shape{input.size[0], input.size[1], input.size[2], input.size[3]};
      const auto memory = Ort::MemoryInfo::CreateCpu(OrtArenaAllocator, OrtMemTypeDefault);
      // ONNX Runtime does not write to its inputs; its interface lacks the const.
      const Ort::Value image = Ort::Value::CreateTensor<float>(memory, const_cast<float*>(input.ptr<float>()),
                                                               input.total(), shape.data(), shape.size());
      const char* input_name = input_name_.c_str();
      const char* output_name = output_name_.c_str();
      outputs_ = session_.Run(Ort::RunOptions(nullptr), &input_name, &image, 1, &output_name, 1);
      const auto result = outputs_.front().GetTensorTypeAndShapeInfo();
      if (result.GetElementType() != ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT) {
        throw ModelError(model_.string() +
                         ": does not output 32-bit float scores; install the model of this version");
      }
      const auto sizes = result.GetShape();
      const std::vector<int> size(sizes.begin(), sizes.end());
      return {static_cast<int>(size.size()), size.data(), CV_32F,
              outputs_.front().GetTensorMutableData<float>()};
    } catch (const Ort::Exception& error) {
      throw ModelError(model_.string() + ": the network cannot be run (" + error.what() +
                       "); install the model that belongs to this version");
    }
  }

  std::string backend() const override {
    return "onnxruntime " + std::string(OrtGetApiBase()->GetVersionString());
  }

 private:
  std::filesystem::path model_;
  Ort::Env environment_;
  Ort::Session session_;
  std::string input_name_;
  std::string output_name_;
  std::vector<Ort::Value> outputs_;  // holds the memory of the last result
};
}  // namespace

std::unique_ptr<Inference> load_onnx_runtime_inference(const std::string& bytes,
                                                       const std::filesystem::path& model) {
  try {
    return std::make_unique<OnnxRuntimeInference>(with_open_image_size(bytes), model);
  } catch (const Ort::Exception& error) {
    throw ModelError(model.string() + ": is damaged or not an ONNX network that ONNX Runtime can run (" +
                     error.what() + "); install the model again");
  }
}

}  // namespace roslam
