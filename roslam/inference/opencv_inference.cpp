// SPDX-License-Identifier: BSD-3-Clause
#include <opencv2/core/utility.hpp>
#include <opencv2/dnn.hpp>

#include "roslam/common/error.hpp"
#include "roslam/common/out_of_memory.hpp"
#include "roslam/inference/inference.hpp"

namespace roslam {

namespace {
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

  std::string backend() const override { return "opencv " + cv::getVersionString(); }

 private:
  cv::dnn::Net net_;
  std::filesystem::path model_;
};
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

}  // namespace roslam
