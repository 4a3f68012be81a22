// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/image_error.hpp"

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace roslam::evaluation {

namespace {
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double per_channel_pixel(double sum, const cv::Mat& where) {
  const int pixels = cv::countNonZero(where);
  return pixels == 0 ? kNaN : sum / (3.0 * pixels);
}

cv::Mat grey(const cv::Mat& image) {
  cv::Mat result;
  cv::cvtColor(image, result, cv::COLOR_BGR2GRAY);
  result.convertTo(result, CV_64F);
  return result;
}

cv::Mat windowed(const cv::Mat& values) {
  cv::Mat result;
  cv::GaussianBlur(values, result, {11, 11}, 1.5);
  return result;
}
}  // namespace

double mean_square_error(const cv::Mat& truth, const cv::Mat& estimate, const cv::Mat& where) {
  const double distance = cv::norm(truth, estimate, cv::NORM_L2, where);
  return per_channel_pixel(distance * distance, where);
}

double mean_absolute_error(const cv::Mat& truth, const cv::Mat& estimate, const cv::Mat& where) {
  return per_channel_pixel(cv::norm(truth, estimate, cv::NORM_L1, where), where);
}

double psnr(double mean_square_error) {
  constexpr double kLeast = 255.0 * 255.0 * 1e-10;  // 100 dB
  return 10.0 * std::log10(255.0 * 255.0 / std::max(mean_square_error, kLeast));
}

double ssim(const cv::Mat& truth, const cv::Mat& estimate, const cv::Mat& where) {
  if (cv::countNonZero(where) == 0) return kNaN;
  const cv::Mat a = grey(truth), b = grey(estimate);
  const cv::Mat mean_a = windowed(a), mean_b = windowed(b);
  const cv::Mat variance_a = windowed(a.mul(a)) - mean_a.mul(mean_a);
  const cv::Mat variance_b = windowed(b.mul(b)) - mean_b.mul(mean_b);
  const cv::Mat covariance = windowed(a.mul(b)) - mean_a.mul(mean_b);
  const double c1 = std::pow(0.01 * 255.0, 2), c2 = std::pow(0.03 * 255.0, 2);
  const cv::Mat similarity = (2.0 * mean_a.mul(mean_b) + c1).mul(2.0 * covariance + c2);
  const cv::Mat most = (mean_a.mul(mean_a) + mean_b.mul(mean_b) + c1).mul(variance_a + variance_b + c2);
  return cv::mean(similarity / most, where)[0];
}

}  // namespace roslam::evaluation
