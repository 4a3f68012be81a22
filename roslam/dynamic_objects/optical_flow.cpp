// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/optical_flow.hpp"

#include <cmath>
#include <opencv2/video/tracking.hpp>

namespace roslam {

namespace {
constexpr int kLevels = 3;          // above the full image
constexpr int kWindow = 13;         // pixels
constexpr float kMaxReturn = 1.0F;  // pixels; limit of the forward-backward error
constexpr double kMinEigenvalue = 1e-3;
}  // namespace

std::vector<cv::Mat> flow_pyramid(const cv::Mat& grey) {
  std::vector<cv::Mat> pyramid;
  cv::buildOpticalFlowPyramid(grey, pyramid, {kWindow, kWindow}, kLevels, true);
  return pyramid;
}

std::vector<std::optional<cv::Point2f>> track_points(const std::vector<cv::Mat>& from,
                                                     const std::vector<cv::Mat>& to,
                                                     const std::vector<cv::Point2f>& points,
                                                     const std::vector<cv::Point2f>& guess) {
  std::vector<std::optional<cv::Point2f>> result(points.size());
  if (points.empty()) return result;
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 12, 0.03);
  std::vector<cv::Point2f> forward = guess.empty() ? points : guess;
  std::vector<cv::Point2f> backward = points;
  std::vector<std::uint8_t> found;
  std::vector<std::uint8_t> returned;
  std::vector<float> error;
  constexpr int kFlags = cv::OPTFLOW_USE_INITIAL_FLOW;
  cv::calcOpticalFlowPyrLK(from, to, points, forward, found, error, {kWindow, kWindow}, kLevels, criteria,
                           kFlags, kMinEigenvalue);
  // The backward pass starts near its solution, so that the finest level suffices.
  cv::calcOpticalFlowPyrLK(to, from, forward, backward, returned, error, {kWindow, kWindow}, 0, criteria,
                           kFlags, kMinEigenvalue);
  const cv::Rect2f image(0.0F, 0.0F, static_cast<float>(to[0].cols), static_cast<float>(to[0].rows));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point2f error_back = backward[i] - points[i];
    const bool good = found[i] != 0 && returned[i] != 0 && image.contains(forward[i]) &&
                      std::hypot(error_back.x, error_back.y) <= kMaxReturn;
    if (good) result[i] = forward[i];
  }
  return result;
}

std::vector<cv::Point2f> thinned(const std::vector<cv::Point2f>& points, std::size_t wanted) {
  if (points.size() <= wanted) return points;
  std::vector<cv::Point2f> result;
  result.reserve(wanted);
  for (std::size_t i = 0; i < wanted; ++i) result.push_back(points[i * points.size() / wanted]);
  return result;
}

}  // namespace roslam
