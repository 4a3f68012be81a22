// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/seam_blending.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace roslam {

namespace {
constexpr int kBlock = 8;               // pixels, side of the blocks of the finest level
constexpr double kLargestShift = 40.0;  // grey levels that exposure explains

struct WeightedDifference {
  cv::Mat sum;     // CV_32FC3, weighted
  cv::Mat weight;  // CV_32FC1
};

cv::Mat three_channels(const cv::Mat& channel) {
  cv::Mat result;
  cv::merge(std::vector<cv::Mat>(3, channel), result);
  return result;
}

WeightedDifference halved(const WeightedDifference& fine) {
  const cv::Size size((fine.sum.cols + 1) / 2, (fine.sum.rows + 1) / 2);
  WeightedDifference coarse;
  cv::resize(fine.sum, coarse.sum, size, 0, 0, cv::INTER_AREA);
  cv::resize(fine.weight, coarse.weight, size, 0, 0, cv::INTER_AREA);
  return coarse;
}

// Pull-push interpolation: this level's mean difference where its weight is high, else that of coarser ones.
cv::Mat interpolated(const WeightedDifference& level) {
  constexpr double kEnough = 0.1;  // weight from which a level is used alone
  if (level.sum.cols <= 1 && level.sum.rows <= 1)
    return level.sum / three_channels(cv::max(level.weight, 1e-9));
  cv::Mat from_coarse;
  cv::resize(interpolated(halved(level)), from_coarse, level.sum.size(), 0, 0, cv::INTER_LINEAR);
  const cv::Mat share = three_channels(cv::min(level.weight / kEnough, 1.0));
  const cv::Mat own = level.sum / three_channels(cv::max(level.weight, 1e-9));
  return from_coarse + (own - from_coarse).mul(share);
}
}  // namespace

cv::Mat matched_to_rim(const cv::Mat& image, const cv::Mat& fill, const cv::Mat& known, const cv::Mat& hole) {
  cv::Mat difference;
  cv::subtract(image, fill, difference, cv::noArray(), CV_32F);
  std::vector<cv::Mat> channels;
  cv::split(cv::abs(difference), channels);
  const cv::Mat largest = cv::max(cv::max(channels[0], channels[1]), channels[2]);
  const cv::Mat is_used = (known != 0) & (hole == 0) & (largest <= kLargestShift);
  if (cv::countNonZero(is_used) == 0) return fill.clone();
  difference.setTo(0, ~is_used);
  cv::Mat weight;
  is_used.convertTo(weight, CV_32F, 1.0 / 255.0);

  const cv::Size blocks(std::max(1, image.cols / kBlock), std::max(1, image.rows / kBlock));
  WeightedDifference coarse;
  cv::resize(difference, coarse.sum, blocks, 0, 0, cv::INTER_AREA);
  cv::resize(weight, coarse.weight, blocks, 0, 0, cv::INTER_AREA);
  cv::Mat shift;
  cv::resize(interpolated(coarse), shift, image.size(), 0, 0, cv::INTER_LINEAR);
  cv::Mat result;
  cv::add(fill, shift, result, cv::noArray(), CV_8U);
  return result;
}

}  // namespace roslam
