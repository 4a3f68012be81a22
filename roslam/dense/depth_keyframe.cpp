// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/depth_keyframe.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/geometry/se3f.hpp"
#include "roslam/restoration/provenance.hpp"
#include "roslam/restoration/source_image.hpp"
#include "roslam/semantics/label_set.hpp"

namespace roslam {

namespace {
constexpr double kUnitsPerMetre = 1000.0;  // of packed depth
constexpr int kColourQuality = 92;         // JPEG, in percent

std::vector<std::uint8_t> encoded(const std::string& extension, const cv::Mat& image,
                                  const std::vector<int>& parameters) {
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(extension, image, bytes, parameters))
    throw Error("a keyframe of the dense map could not be compressed");
  return bytes;
}

Camera reduced_camera(const Camera& camera, int stride) {
  Camera reduced = camera;
  reduced.width = (camera.width + stride - 1) / stride;
  reduced.height = (camera.height + stride - 1) / stride;
  for (double* value : {&reduced.fx, &reduced.fy, &reduced.cx, &reduced.cy}) *value /= stride;
  reduced.model = LensModel::kPinhole;
  reduced.distortion = {};
  return reduced;
}

DepthOptions with_limit(DepthOptions depth, double max_depth) {
  depth.max_depth = std::max(depth.min_depth, std::min(depth.max_depth, max_depth));
  return depth;
}
}  // namespace

PackedDepthKeyframe pack(const DepthKeyframe& keyframe) {
  cv::Mat millimetres;
  keyframe.depth.convertTo(millimetres, CV_16UC1, kUnitsPerMetre);
  cv::Mat marks;
  const cv::Mat beyond =
      keyframe.beyond.empty() ? cv::Mat::zeros(keyframe.labels.size(), CV_8UC1) : keyframe.beyond;
  cv::merge(std::array<cv::Mat, 3>{keyframe.labels, keyframe.provenance, beyond}, marks);
  const std::vector<int> fast{cv::IMWRITE_PNG_COMPRESSION, 1};
  return {keyframe.camera,
          encoded(".jpg", keyframe.colour, {cv::IMWRITE_JPEG_QUALITY, kColourQuality}),
          encoded(".png", millimetres, fast),
          encoded(".png", marks, fast),
          keyframe.reach,
          keyframe.noise};
}

DepthKeyframe unpack(const PackedDepthKeyframe& packed) {
  DepthKeyframe keyframe;
  keyframe.camera = packed.camera;
  keyframe.colour = cv::imdecode(packed.colour, cv::IMREAD_COLOR);
  cv::imdecode(packed.depth, cv::IMREAD_UNCHANGED).convertTo(keyframe.depth, CV_32FC1, 1.0 / kUnitsPerMetre);
  const cv::Mat marks = cv::imdecode(packed.marks, cv::IMREAD_UNCHANGED);
  cv::extractChannel(marks, keyframe.labels, 0);
  cv::extractChannel(marks, keyframe.provenance, 1);
  cv::extractChannel(marks, keyframe.beyond, 2);
  keyframe.reach = packed.reach;
  keyframe.noise = packed.noise;
  return keyframe;
}

DepthKeyframeReducer::DepthKeyframeReducer(const Camera& camera, const DenseOptions& dense,
                                           const DepthOptions& depth)
    : depth_(with_limit(depth, dense.max_depth)),
      rays_(camera),
      reduced_(reduced_camera(camera, dense.stride)),
      reduced_rays_(reduced_) {
  map_x_.create(reduced_.height, reduced_.width, CV_32FC1);
  map_y_.create(map_x_.size(), CV_32FC1);
  for (int y = 0; y < reduced_.height; ++y) {
    for (int x = 0; x < reduced_.width; ++x) {
      const Eigen::Vector2d taken = camera.distort(Eigen::Vector2d(x, y) * dense.stride);
      map_x_.at<float>(y, x) = static_cast<float>(taken.x());
      map_y_.at<float>(y, x) = static_cast<float>(taken.y());
    }
  }
}

DepthKeyframe DepthKeyframeReducer::reduce(const cv::Mat& colour, const cv::Mat& depth,
                                           const cv::Mat& provenance, const cv::Mat& hidden) const {
  cv::Mat kept = cv::Mat::zeros(colour.size(), CV_32FC1);
  if (!depth.empty()) depth.copyTo(kept, clear_of_edges(depth, depth_));
  cv::Mat beyond;
  // All neighbours have to be far too, because single far readings are often outliers.
  if (!depth.empty()) cv::erode(depth > depth_.max_depth, beyond, cv::Mat());
  if (!hidden.empty()) kept.setTo(0, hidden);
  if (!hidden.empty() && !beyond.empty()) beyond.setTo(0, hidden);
  DepthKeyframe keyframe;
  keyframe.camera = reduced_;
  const auto nearest = [&](const cv::Mat& image, double otherwise) {
    if (image.empty()) return cv::Mat(map_x_.size(), CV_8UC1, cv::Scalar(otherwise));
    cv::Mat result;
    cv::remap(image, result, map_x_, map_y_, cv::INTER_NEAREST, cv::BORDER_CONSTANT, otherwise);
    return result;
  };
  cv::remap(colour, keyframe.colour, map_x_, map_y_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  keyframe.depth = nearest(kept, 0.0);
  keyframe.labels = cv::Mat(keyframe.depth.size(), CV_8UC1, cv::Scalar(kVoid));
  keyframe.provenance = nearest(provenance, static_cast<double>(Provenance::kMeasured));
  keyframe.beyond = nearest(beyond, 0.0);
  keyframe.beyond.setTo(0, keyframe.provenance != static_cast<double>(Provenance::kMeasured));
  keyframe.reach = depth_.max_depth;
  return keyframe;
}

void DepthKeyframeReducer::label(DepthKeyframe& keyframe, const cv::Mat& labels,
                                 const SE3& T_labelled_camera) const {
  const SE3f labelled_from_camera(T_labelled_camera);
  for (int y = 0; y < keyframe.depth.rows; ++y) {
    for (int x = 0; x < keyframe.depth.cols; ++x) {
      const float depth = keyframe.depth.at<float>(y, x);
      const bool is_measured =
          keyframe.provenance.at<std::uint8_t>(y, x) == static_cast<std::uint8_t>(Provenance::kMeasured);
      if (depth <= 0.0F || !is_measured) continue;
      const auto pixel = rays_.pixel(labelled_from_camera * reduced_rays_.point(x, y, depth));
      if (!pixel) continue;
      keyframe.labels.at<std::uint8_t>(y, x) =
          labels.at<std::uint8_t>(cvRound(pixel->y()), cvRound(pixel->x()));
    }
  }
}

}  // namespace roslam
