// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/source_image.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "roslam/restoration/depth_filling.hpp"

namespace roslam {

cv::Mat clear_of_edges(const cv::Mat& depth, const DepthOptions& options) {
  const cv::Mat known = (depth >= options.min_depth) & (depth <= options.max_depth);  // false for NaN
  cv::Mat nearest = depth.clone();
  nearest.setTo(1e6, ~known);
  cv::Mat farthest = depth.clone();
  farthest.setTo(0, ~known);
  cv::erode(nearest, nearest, cv::Mat());
  cv::dilate(farthest, farthest, cv::Mat());
  cv::Mat tolerance = farthest * options.edge_growth + options.edge_ratio;
  return known & (farthest - nearest <= tolerance.mul(farthest));
}

std::array<cv::Mat, kGreyLevels> grey_levels(const cv::Mat& colour) {
  std::array<cv::Mat, kGreyLevels> levels;
  cv::Mat grey;
  cv::cvtColor(colour, grey, cv::COLOR_BGR2GRAY);
  for (cv::Mat& level : levels) {
    cv::resize(grey, level, {}, 0.5, 0.5, cv::INTER_AREA);
    grey = level;
  }
  return levels;
}

cv::Mat depth_range_of(const cv::Mat& depth) {
  cv::Mat ranges = cv::Mat::zeros((depth.rows + kDepthBlock - 1) / kDepthBlock,
                                  (depth.cols + kDepthBlock - 1) / kDepthBlock, CV_32FC2);
  for (int y = 0; y < depth.rows; ++y) {
    const float* row = depth.ptr<float>(y);
    auto* of_row = ranges.ptr<cv::Vec2f>(y / kDepthBlock);
    for (int x = 0; x < depth.cols; ++x) {
      if (!(row[x] > 0.0F)) continue;
      cv::Vec2f& range = of_row[x / kDepthBlock];
      range[0] = range[0] > 0.0F ? std::min(range[0], row[x]) : row[x];
      range[1] = std::max(range[1], row[x]);
    }
  }
  return ranges;
}

std::optional<SourceImage> prepare_source(const PosedImage& image, const DepthOptions& options) {
  if (!image.T_world_camera || image.depth.empty()) return std::nullopt;
  SourceImage source{image.timestamp, *image.T_world_camera, image.colour, {}, {}, {}, {}, {}};
  source.is_static = image.removed.empty() ? cv::Mat(image.colour.size(), CV_8UC1, cv::Scalar(255))
                                           : cv::Mat(image.removed == 0);
  source.is_measured = clear_of_edges(image.depth, options) & source.is_static;
  if (cv::countNonZero(source.is_measured) == 0) return std::nullopt;
  cv::Mat measured = cv::Mat::zeros(image.depth.size(), CV_32FC1);
  image.depth.copyTo(measured, source.is_measured);
  source.depth = filled_depth(measured, image.colour);
  source.depth.setTo(0, ~source.is_static);
  source.grey = grey_levels(image.colour);
  source.depth_range = depth_range_of(source.depth);
  return source;
}

}  // namespace roslam
