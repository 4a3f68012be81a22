// SPDX-License-Identifier: BSD-3-Clause
#include "recording/restoration_image.hpp"

#include <opencv2/imgproc.hpp>
#include <vector>

namespace roslam::recording {

namespace {
const cv::Scalar kOutlineColour(40, 40, 240);

void tint(cv::Mat& image, const cv::Mat& where, const cv::Vec3b& colour) {
  constexpr double kShare = 0.45;
  cv::Mat tinted;
  cv::addWeighted(image, 1.0 - kShare, cv::Mat(image.size(), CV_8UC3, cv::Scalar(colour)), kShare, 0.0,
                  tinted);
  tinted.copyTo(image, where);
}
}  // namespace

cv::Mat restoration_image(const cv::Mat& taken, const RestoredImage& restored) {
  const cv::Mat hole = restored.provenance != static_cast<double>(Provenance::kMeasured);
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(hole, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  cv::Mat before = taken.clone();
  cv::drawContours(before, outlines, -1, kOutlineColour, 2);
  cv::Mat origin = restored.colour.clone();
  for (const Provenance provenance : {Provenance::kReprojected, Provenance::kInpainted})
    tint(origin, restored.provenance == static_cast<double>(provenance), provenance_colour(provenance));
  cv::Mat image;
  cv::hconcat(std::vector<cv::Mat>{before, restored.colour, origin}, image);
  return image;
}

void RestorationStrip::add(const cv::Mat& taken, const RestoredImage& restored) {
  constexpr double kWidth = 1200.0;  // pixels
  if (restored.pixels_of(Provenance::kMeasured) == restored.colour.total() || !images_.wants()) return;
  cv::Mat image = restoration_image(taken, restored);
  const double scale = kWidth / image.cols;
  cv::resize(image, image, {}, scale, scale, cv::INTER_AREA);
  images_.add(image);
}

cv::Mat RestorationStrip::strip() const {
  const std::vector<cv::Mat> images = images_.images();
  cv::Mat result;
  if (!images.empty()) cv::vconcat(images, result);
  return result;
}

}  // namespace roslam::recording
