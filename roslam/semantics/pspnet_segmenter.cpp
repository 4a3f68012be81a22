// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/semantics/pspnet_segmenter.hpp"

#include <algorithm>
#include <opencv2/dnn.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/common/resources.hpp"
#include "roslam/common/stopwatch.hpp"
#include "roslam/semantics/score_labels.hpp"

namespace roslam {

namespace {

cv::Mat as_bgr(const cv::Mat& image) {
  if (image.empty()) throw InputError("segmentation needs an image, this one is empty");
  cv::Mat bgr;
  switch (image.type()) {
    case CV_8UC3:
      return image;
    case CV_8UC4:
      cv::cvtColor(image, bgr, cv::COLOR_BGRA2BGR);
      return bgr;
    case CV_8UC1:
      cv::cvtColor(image, bgr, cv::COLOR_GRAY2BGR);
      return bgr;
    default:
      throw InputError("segmentation needs an 8-bit image with 1, 3 or 4 channels");
  }
}
}  // namespace

cv::Size working_size(const cv::Size& image, int working_side) {
  const double scale = static_cast<double>(working_side) / std::max(image.width, image.height);
  const auto side = [&](int pixels) {
    return std::max(kSegmenterMultiple,
                    kSegmenterMultiple * static_cast<int>(pixels * scale / kSegmenterMultiple + 0.5));
  };
  return {side(image.width), side(image.height)};
}

PspnetSegmenter::PspnetSegmenter(const std::filesystem::path& model, const SegmenterOptions& options,
                                 InferenceBackend backend)
    : model_(model), options_(options) {
  options_.validate();
  inference_ = load_inference(model, backend);
  const int size[] = {1, 3, 2 * kSegmenterMultiple,
                      2 * kSegmenterMultiple};  // trial run to check the shape of the output
  if (!cv::checkRange(scores_for(cv::Mat(4, size, CV_32F, cv::Scalar(0))))) {
    throw ModelError(model_.string() + ": gives scores that are not finite; install the model again");
  }
}

cv::Mat PspnetSegmenter::scores_for(const cv::Mat& blob) {
  const cv::Mat scores = inference_->run(blob);
  const bool has_shape = scores.dims == 4 && scores.type() == CV_32F && scores.size[0] == 1;
  if (!has_shape || scores.size[1] != kClasses) {
    throw ModelError(model_.string() + ": gives " +
                     (has_shape ? std::to_string(scores.size[1]) + " classes" : "no class scores") +
                     " where the " + std::to_string(kClasses) +
                     " of Cityscapes are expected; install the model that belongs to this version");
  }
  if (scores.size[2] < 1 || scores.size[2] > blob.size[2] || scores.size[3] < 1 ||
      scores.size[3] > blob.size[3]) {
    throw ModelError(model_.string() +
                     ": gives scores whose shape does not match the image; install the model that "
                     "belongs to this version");
  }
  return scores;
}

Segmentation PspnetSegmenter::segment(const cv::Mat& image) {
  const Stopwatch watch;
  const cv::Mat bgr = as_bgr(image);
  const cv::Size size = working_size(bgr.size(), options_.working_side);
  cv::resize(bgr, input_image_, size, 0, 0,
             size.area() < bgr.size().area() ? cv::INTER_AREA : cv::INTER_LINEAR);
  cv::dnn::blobFromImage(input_image_, blob_, 1.0 / 255.0, {}, {}, true);
  Segmentation result = labels_from_scores(scores_for(blob_), bgr.size());
  result.seconds = watch.seconds();
  return result;
}

std::filesystem::path find_segmentation_model() { return find_resource("roslam-pspnet.onnx"); }

ModelError missing_segmentation_model() {
  return ModelError(
      "models/roslam-pspnet.onnx: not found beside the program; install it or name it with --model");
}

}  // namespace roslam
