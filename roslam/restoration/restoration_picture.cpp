// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/restoration_picture.hpp"

#include <opencv2/imgproc.hpp>
#include <vector>

namespace roslam {

namespace {
const cv::Scalar kOutlineColour(40, 40, 240);

void tint(cv::Mat& picture, const cv::Mat& where, const cv::Vec3b& colour) {
  constexpr double kShare = 0.45;
  cv::Mat tinted;
  cv::addWeighted(picture, 1.0 - kShare, cv::Mat(picture.size(), CV_8UC3, cv::Scalar(colour)), kShare, 0.0,
                  tinted);
  tinted.copyTo(picture, where);
}
}  // namespace

cv::Mat restoration_picture(const cv::Mat& taken, const RestoredView& restored) {
  const cv::Mat hole = restored.provenance != static_cast<double>(Provenance::kMeasured);
  std::vector<std::vector<cv::Point>> outlines;
  cv::findContours(hole, outlines, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  cv::Mat before = taken.clone();
  cv::drawContours(before, outlines, -1, kOutlineColour, 2);
  cv::Mat origin = restored.colour.clone();
  for (const Provenance provenance : {Provenance::kReprojected, Provenance::kInvented})
    tint(origin, restored.provenance == static_cast<double>(provenance), provenance_colour(provenance));
  cv::Mat picture;
  cv::hconcat(std::vector<cv::Mat>{before, restored.colour, origin}, picture);
  return picture;
}

void RestorationStrip::add(const cv::Mat& taken, const RestoredView& restored) {
  constexpr double kWidth = 1200.0;  // pixels
  if (restored.pixels_of(Provenance::kMeasured) == restored.colour.total() || !pictures_.wants()) return;
  cv::Mat picture = restoration_picture(taken, restored);
  const double scale = kWidth / picture.cols;
  cv::resize(picture, picture, {}, scale, scale, cv::INTER_AREA);
  pictures_.add(picture);
}

cv::Mat RestorationStrip::strip() const {
  const std::vector<cv::Mat> pictures = pictures_.pictures();
  cv::Mat result;
  if (!pictures.empty()) cv::vconcat(pictures, result);
  return result;
}

}  // namespace roslam
