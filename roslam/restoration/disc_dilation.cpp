// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/disc_dilation.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace roslam {

cv::Mat dilated_by_disc(const cv::Mat& mask, int side) {
  CV_Assert(mask.type() == CV_8UC1 && side > 0 && side % 2 == 1);
  const int radius = side / 2;
  const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side});
  std::vector<int> reach;  // of each row of the disc, to both sides of its centre
  for (int row = 0; row < side; ++row) reach.push_back((cv::countNonZero(disc.row(row)) - 1) / 2);

  cv::Mat result = cv::Mat::zeros(mask.size(), CV_8UC1);
  const auto paint_run = [&](int y, int first, int end) {
    for (int row = std::max(y - radius, 0); row <= std::min(y + radius, mask.rows - 1); ++row) {
      const int by = reach[static_cast<std::size_t>(row - y + radius)];
      auto* painted = result.ptr<std::uint8_t>(row);
      std::fill(painted + std::max(first - by, 0), painted + std::min(end + by, mask.cols), 255);
    }
  };
  for (int y = 0; y < mask.rows; ++y) {
    const auto* row = mask.ptr<std::uint8_t>(y);
    const auto* row_end = row + mask.cols;
    const auto is_set = [](std::uint8_t value) { return value != 0; };
    for (const auto* first = std::find_if(row, row_end, is_set); first != row_end;) {
      const auto* end = std::find(first, row_end, 0);
      paint_run(y, static_cast<int>(first - row), static_cast<int>(end - row));
      first = std::find_if(end, row_end, is_set);
    }
  }
  return result;
}

}  // namespace roslam
