// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/seam.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace roslam {

namespace {
constexpr int kBlock = 8;               // pixels over which differences are averaged first
constexpr double kLargestShift = 40.0;  // grey levels that light explains

struct Weighted {
  cv::Mat sum;     // CV_32FC3, of differences
  cv::Mat weight;  // CV_32FC1
};

cv::Mat in_three(const cv::Mat& channel) {
  cv::Mat result;
  cv::merge(std::vector<cv::Mat>(3, channel), result);
  return result;
}

Weighted halved(const Weighted& fine) {
  const cv::Size size((fine.sum.cols + 1) / 2, (fine.sum.rows + 1) / 2);
  Weighted coarse;
  cv::resize(fine.sum, coarse.sum, size, 0, 0, cv::INTER_AREA);
  cv::resize(fine.weight, coarse.weight, size, 0, 0, cv::INTER_AREA);
  return coarse;
}

// The mean difference everywhere: what is known at a scale, and between it what coarser scales know.
cv::Mat spread(const Weighted& at) {
  constexpr double kEnough = 0.1;  // weight that a scale needs to speak for itself
  if (at.sum.cols <= 1 && at.sum.rows <= 1) return at.sum / in_three(cv::max(at.weight, 1e-9));
  cv::Mat from_coarse;
  cv::resize(spread(halved(at)), from_coarse, at.sum.size(), 0, 0, cv::INTER_LINEAR);
  const cv::Mat trust = in_three(cv::min(at.weight / kEnough, 1.0));
  const cv::Mat own = at.sum / in_three(cv::max(at.weight, 1e-9));
  return from_coarse + (own - from_coarse).mul(trust);
}
}  // namespace

cv::Mat matched_to_rim(const cv::Mat& picture, const cv::Mat& paint, const cv::Mat& known,
                       const cv::Mat& hole) {
  cv::Mat difference;
  cv::subtract(picture, paint, difference, cv::noArray(), CV_32F);
  std::vector<cv::Mat> channels;
  cv::split(cv::abs(difference), channels);
  const cv::Mat largest = cv::max(cv::max(channels[0], channels[1]), channels[2]);
  const cv::Mat tells = (known != 0) & (hole == 0) & (largest <= kLargestShift);
  if (cv::countNonZero(tells) == 0) return paint.clone();
  difference.setTo(0, ~tells);
  cv::Mat weight;
  tells.convertTo(weight, CV_32F, 1.0 / 255.0);

  const cv::Size blocks(std::max(1, picture.cols / kBlock), std::max(1, picture.rows / kBlock));
  Weighted coarse;
  cv::resize(difference, coarse.sum, blocks, 0, 0, cv::INTER_AREA);
  cv::resize(weight, coarse.weight, blocks, 0, 0, cv::INTER_AREA);
  cv::Mat shift;
  cv::resize(spread(coarse), shift, picture.size(), 0, 0, cv::INTER_LINEAR);
  cv::Mat result;
  cv::add(paint, shift, result, cv::noArray(), CV_8U);
  return result;
}

}  // namespace roslam
