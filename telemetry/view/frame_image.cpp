// SPDX-License-Identifier: BSD-3-Clause
#include "telemetry/view/frame_image.hpp"

#include <algorithm>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace roslam::telemetry {

namespace {
constexpr int kWidth = 480;
constexpr int kJpegQuality = 70;
const cv::Scalar kRemoved(80, 110, 255), kUsed(150, 235, 120);  // BGR

void tint(cv::Mat& image, const cv::Mat& mask) {
  cv::Mat small;
  cv::resize(mask, small, image.size(), 0.0, 0.0, cv::INTER_NEAREST);
  cv::Mat tinted;
  cv::addWeighted(image, 0.5, cv::Mat(image.size(), image.type(), kRemoved), 0.5, 0.0, tinted);
  tinted.copyTo(image, small);
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(small, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_SIMPLE);
  cv::drawContours(image, outlines, -1, kRemoved, 1, cv::LINE_8);
}
}  // namespace

std::string frame_jpeg(const cv::Mat& colour, const cv::Mat& mask, const std::vector<cv::Point2f>& points,
                       const std::vector<cv::Point2f>& removed_points) {
  if (colour.empty()) return {};
  const double scale = std::min(1.0, static_cast<double>(kWidth) / colour.cols);
  cv::Mat image;
  cv::resize(colour, image, {}, scale, scale, scale < 1.0 ? cv::INTER_AREA : cv::INTER_NEAREST);
  if (!mask.empty()) tint(image, mask);
  const auto place = [scale](const cv::Point2f& p) {
    return cv::Point(cvRound(scale * static_cast<double>(p.x)), cvRound(scale * static_cast<double>(p.y)));
  };
  for (const cv::Point2f& point : points)
    cv::rectangle(image, cv::Rect(place(point) - cv::Point(1, 1), cv::Size(2, 2)), kUsed, cv::FILLED);
  for (const cv::Point2f& point : removed_points)
    cv::drawMarker(image, place(point), kRemoved, cv::MARKER_TILTED_CROSS, 5, 1);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  return {bytes.begin(), bytes.end()};
}

}  // namespace roslam::telemetry
