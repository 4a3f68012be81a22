// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/stereo/dense_stereo.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr int kBlock = 5;           // pixels
constexpr int kStep = 16;           // disparities are in sixteenths of a pixel, and their number a multiple
constexpr double kMostRange = 256;  // pixels

cv::Mat reduced(const cv::Mat& image, double scale) {
  cv::Mat grey = image, result;
  if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  if (scale == 1.0) return grey;
  cv::resize(grey, result, {}, scale, scale, cv::INTER_AREA);
  return result;
}

// Between four disparities of one surface; the nearest one where they are of several or not all known.
float between(const cv::Mat_<std::int16_t>& disparities, float x, float y) {
  constexpr int kOneSurface = kStep;
  const int x0 = std::clamp(static_cast<int>(std::floor(x)), 0, disparities.cols - 2);
  const int y0 = std::clamp(static_cast<int>(std::floor(y)), 0, disparities.rows - 2);
  const std::int16_t *upper = disparities[y0] + x0, *lower = disparities[y0 + 1] + x0;
  const auto [least, most] = std::minmax({upper[0], upper[1], lower[0], lower[1]});
  const float u = std::clamp(x - static_cast<float>(x0), 0.0F, 1.0F);
  const float v = std::clamp(y - static_cast<float>(y0), 0.0F, 1.0F);
  if (least <= 0 || most - least > kOneSurface) return (v < 0.5F ? upper : lower)[u < 0.5F ? 0 : 1];
  const float above = static_cast<float>(upper[0]) + u * static_cast<float>(upper[1] - upper[0]);
  const float below = static_cast<float>(lower[0]) + u * static_cast<float>(lower[1] - lower[0]);
  return above + v * (below - above);
}
}  // namespace

DenseStereo::DenseStereo(const Camera& camera, const StereoOptions& options)
    : camera_(camera), options_(options) {
  options_.validate();
  if (!camera.is_stereo()) throw CalibrationError("camera calibration: baseline is not set");
}

cv::Mat DenseStereo::disparities(const cv::Mat& left, const cv::Mat& right) const {
  const double nearest = options_.dense_scale * camera_.fx * camera_.baseline / options_.min_depth;
  const double range = std::min({nearest, 0.5 * left.cols, kMostRange});
  const int count = std::max(1, cvCeil(range / kStep)) * kStep;
  if (left.cols <= 2 * count || left.rows < kStep)
    return cv::Mat::zeros(left.size(), CV_16SC1);  // none is known
  // Small and large changes of disparity cost that much, as OpenCV's documentation advises.
  constexpr int kSmall = 8 * kBlock * kBlock, kLarge = 32 * kBlock * kBlock;
  constexpr int kMostDifference = 1, kMostGradient = 31, kUniqueness = 8, kSpeckle = 60, kSpeckleRange = 1;
  const auto matcher =
      cv::StereoSGBM::create(0, count, kBlock, kSmall, kLarge, kMostDifference, kMostGradient, kUniqueness,
                             kSpeckle, kSpeckleRange, cv::StereoSGBM::MODE_SGBM_3WAY);
  cv::Mat result;
  matcher->compute(left, right, result);
  return result;
}

cv::Mat DenseStereo::depth(const cv::Mat& left, const cv::Mat& right) const {
  const double scale = options_.dense_scale;
  const cv::Mat_<std::int16_t> disparities = this->disparities(reduced(left, scale), reduced(right, scale));
  cv::Mat depth(left.size(), CV_32FC1);
  const float per_x = static_cast<float>(disparities.cols) / static_cast<float>(left.cols);
  const float per_y = static_cast<float>(disparities.rows) / static_cast<float>(left.rows);
  const auto numerator = static_cast<float>(kStep * per_x * camera_.fx * camera_.baseline);
  for (int y = 0; y < depth.rows; ++y) {
    auto* to = depth.ptr<float>(y);
    const float from_y = (static_cast<float>(y) + 0.5F) * per_y - 0.5F;
    for (int x = 0; x < depth.cols; ++x) {
      const float disparity = between(disparities, (static_cast<float>(x) + 0.5F) * per_x - 0.5F, from_y);
      to[x] = disparity > 0.0F ? numerator / disparity : 0.0F;
    }
  }
  return depth;
}

Frame DenseStereo::with_depth(Frame frame) const {
  if (frame.depth.empty() && frame.right.size() == frame.colour.size())
    frame.depth = depth(frame.colour, frame.right);
  return frame;
}

DepthNoise dense_stereo_noise(const Camera& camera, const StereoOptions& options) {
  constexpr double kSigma = 0.3;      // pixels of the reduced image
  constexpr double kConstant = 1e-3;  // metres
  constexpr double kMost = 1.0;       // 1/metre
  return {kConstant, std::min(kMost, kSigma / (options.dense_scale * camera.fx * camera.baseline))};
}

}  // namespace roslam
