// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/semantics/pspnet_segmenter.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/common/resources.hpp"
#include "roslam/common/stopwatch.hpp"
#include "roslam/inference/score_grid.hpp"
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
  inference_ = load_inference(model, backend, options.threads);
  const int side = 2 * kSegmenterMultiple;  // trial run to check the shape of the output
  const int size[] = {1, 3, side, side};
  const cv::Mat scores = inference_->run(cv::Mat(4, size, CV_32F, cv::Scalar(0)));
  const bool has_shape = scores.dims == 4 && scores.type() == CV_32F && scores.size[0] == 1;
  if (!has_shape) check_scores({}, 0, {side, side});
  check_scores({scores.size[3], scores.size[2]}, scores.size[1], {side, side});
  if (!cv::checkRange(scores)) {
    throw ModelError(model_.string() + ": gives scores that are not finite; install the model again");
  }
}

void PspnetSegmenter::check_scores(const cv::Size& scores, int classes, const cv::Size& image) const {
  if (classes != kClasses) {
    throw ModelError(model_.string() + ": gives " +
                     (classes > 0 ? std::to_string(classes) + " classes" : "no class scores") +
                     " where the " + std::to_string(kClasses) +
                     " of Cityscapes are expected; install the model that belongs to this version");
  }
  if (scores.empty() || scores.height > image.height || scores.width > image.width) {
    throw ModelError(model_.string() +
                     ": gives scores whose shape does not match the image; install the model that "
                     "belongs to this version");
  }
}

Segmentation PspnetSegmenter::segment(const cv::Mat& image) {
  const Stopwatch watch;
  const cv::Mat bgr = as_bgr(image);
  const cv::Size size = working_size(bgr.size(), options_.working_side);
  cv::resize(bgr, input_image_, size, 0, 0,
             size.area() < bgr.size().area() ? cv::INTER_AREA : cv::INTER_LINEAR);
  const ScoreGrid grid = inference_->scores(input_image_);
  check_scores({grid.columns(), grid.rows()}, grid.scores.channels, size);
  Segmentation result = labels_from_scores(grid, bgr.size());
  result.seconds = watch.seconds();
  return result;
}

std::string PspnetSegmenter::backend() const { return inference_->backend(); }

std::string PspnetSegmenter::note() const { return inference_->note(); }

std::filesystem::path find_segmentation_model() { return find_resource("roslam-pspnet.onnx"); }

ModelError missing_segmentation_model() {
  return ModelError(
      "models/roslam-pspnet.onnx: not found beside the program; install it or name it with --model");
}

}  // namespace roslam
