// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/restoration_picture.hpp"

#include <opencv2/imgproc.hpp>
#include <vector>

namespace roslam {

namespace {
const cv::Scalar kReprojectedColour(90, 200, 60);
const cv::Scalar kInventedColour(200, 40, 220);
const cv::Scalar kOutlineColour(40, 40, 240);

void tint(cv::Mat& picture, const cv::Mat& where, const cv::Scalar& colour) {
  constexpr double kShare = 0.45;
  cv::Mat tinted;
  cv::addWeighted(picture, 1.0 - kShare, cv::Mat(picture.size(), CV_8UC3, colour), kShare, 0.0, tinted);
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
  tint(origin, restored.provenance == static_cast<double>(Provenance::kReprojected), kReprojectedColour);
  tint(origin, restored.provenance == static_cast<double>(Provenance::kInvented), kInventedColour);
  cv::Mat picture;
  cv::hconcat(std::vector<cv::Mat>{before, restored.colour, origin}, picture);
  return picture;
}

}  // namespace roslam
