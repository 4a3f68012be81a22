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

// Mean difference of the rim in blocks; no sum if no pixel of the rim can be used.
WeightedDifference difference_along_rim(const cv::Mat& image, const cv::Mat& fill, const cv::Mat& known,
                                        const cv::Mat& hole) {
  const cv::Size blocks(std::max(1, image.cols / kBlock), std::max(1, image.rows / kBlock));
  WeightedDifference blocked{cv::Mat::zeros(blocks, CV_32FC3), cv::Mat::zeros(blocks, CV_32FC1)};
  bool is_any_used = false;
  for (int y = 0; y < image.rows; ++y) {
    const auto* is_known = known.ptr<std::uint8_t>(y);
    const auto* is_hole = hole.ptr<std::uint8_t>(y);
    const auto* taken = image.ptr<cv::Vec3b>(y);
    const auto* filled = fill.ptr<cv::Vec3b>(y);
    auto* sums = blocked.sum.ptr<cv::Vec3f>(y * blocks.height / image.rows);
    auto* weights = blocked.weight.ptr<float>(y * blocks.height / image.rows);
    for (int x = 0; x < image.cols; ++x) {
      if (is_known[x] == 0 || is_hole[x] != 0) continue;
      const cv::Vec3i difference = cv::Vec3i(taken[x]) - cv::Vec3i(filled[x]);
      if (cv::norm(difference, cv::NORM_INF) > kLargestShift) continue;
      const int block = x * blocks.width / image.cols;
      sums[block] += cv::Vec3f(difference);
      weights[block] += 1.0F;
      is_any_used = true;
    }
  }
  if (!is_any_used) return {};
  const double pixels = static_cast<double>(image.total()) / static_cast<double>(blocks.area());
  blocked.sum /= pixels;
  blocked.weight /= pixels;
  return blocked;
}

// Where an image of a size is sampled, between two neighbours, for a coordinate of an image of another size.
struct Between {
  int low, high;
  float share;  // of high
};

std::vector<Between> positions(int size, int coarse_size) {
  std::vector<Between> result;
  const float scale = static_cast<float>(coarse_size) / static_cast<float>(size);
  for (int i = 0; i < size; ++i) {
    const float at =
        std::clamp((static_cast<float>(i) + 0.5F) * scale - 0.5F, 0.0F, static_cast<float>(coarse_size - 1));
    const int low = static_cast<int>(at);
    result.push_back({low, std::min(low + 1, coarse_size - 1), at - static_cast<float>(low)});
  }
  return result;
}

cv::Vec3f between(const cv::Vec3f* row, const Between& at) {
  return row[at.low] + at.share * (row[at.high] - row[at.low]);
}
}  // namespace

cv::Mat matched_to_rim(const cv::Mat& image, const cv::Mat& fill, const cv::Mat& known, const cv::Mat& hole) {
  cv::Mat result = fill.clone();
  const WeightedDifference difference = difference_along_rim(image, fill, known, hole);
  if (difference.sum.empty()) return result;
  const cv::Mat shift = interpolated(difference);
  const auto columns = positions(image.cols, shift.cols), rows = positions(image.rows, shift.rows);
  for (int y = 0; y < image.rows; ++y) {
    const Between& row = rows[static_cast<std::size_t>(y)];
    const auto *upper = shift.ptr<cv::Vec3f>(row.low), *lower = shift.ptr<cv::Vec3f>(row.high);
    const auto* is_hole = hole.ptr<std::uint8_t>(y);
    auto* colours = result.ptr<cv::Vec3b>(y);
    for (int x = 0; x < image.cols; ++x) {
      if (is_hole[x] == 0) continue;
      const Between& column = columns[static_cast<std::size_t>(x)];
      const cv::Vec3f above = between(upper, column), below = between(lower, column);
      colours[x] = cv::Vec3f(colours[x]) + above + row.share * (below - above);
    }
  }
  return result;
}

}  // namespace roslam
