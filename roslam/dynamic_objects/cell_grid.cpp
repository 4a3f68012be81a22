// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/cell_grid.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace roslam {

namespace {
constexpr int kColumns = 160;  // of cells, about

template <typename Number>
void find_boxes(const cv::Mat& numbers, std::vector<cv::Rect>& boxes) {
  struct Range {
    cv::Point least{std::numeric_limits<int>::max(), std::numeric_limits<int>::max()};
    cv::Point largest{-1, -1};
  };
  std::vector<Range> ranges(boxes.size());
  for (int y = 0; y < numbers.rows; ++y) {
    const auto* row = numbers.ptr<Number>(y);
    for (int x = 0; x < numbers.cols;) {
      const Number number = row[x];
      const int begin = x;
      while (++x < numbers.cols && row[x] == number) continue;
      if (number == 0) continue;
      Range& range = ranges[static_cast<std::size_t>(number)];
      range.least = {std::min(range.least.x, begin), std::min(range.least.y, y)};
      range.largest = {std::max(range.largest.x, x - 1), y};
    }
  }
  for (std::size_t i = 1; i < boxes.size(); ++i) {
    if (ranges[i].largest.x >= 0) boxes[i] = {ranges[i].least, ranges[i].largest + cv::Point(1, 1)};
  }
}
}  // namespace

std::vector<cv::Rect> boxes_of_numbers(const cv::Mat& numbers, int count) {
  std::vector<cv::Rect> boxes(static_cast<std::size_t>(count) + 1);
  numbers.type() == CV_16UC1 ? find_boxes<std::uint16_t>(numbers, boxes) : find_boxes<int>(numbers, boxes);
  return boxes;
}

CellGrid::CellGrid(const Camera& camera)
    : camera_(camera),
      side_(std::max(1, (camera.width + kColumns / 2) / kColumns)),
      size_((camera.width + side_ - 1) / side_, (camera.height + side_ - 1) / side_),
      metres_per_depth_(static_cast<float>(side_ / camera.fx)) {
  rays_.reserve(cells());
  for (int y = 0; y < size_.height; ++y) {
    for (int x = 0; x < size_.width; ++x) {
      const cv::Point pixel = pixel_of({x, y});
      const Eigen::Vector2d undistorted = camera.undistort({pixel.x, pixel.y});
      rays_.push_back(camera.unproject(undistorted, 1.0).cast<float>());
    }
  }
  const auto bounds = camera.undistorted_bounds();
  projection_ << static_cast<float>(camera.fx / side_), 0.0F,
      static_cast<float>((camera.cx - bounds[0]) / side_), 0.0F, static_cast<float>(camera.fy / side_),
      static_cast<float>((camera.cy - bounds[1]) / side_), 0.0F, 0.0F, 1.0F;
  table_size_ = {static_cast<int>((bounds[2] - bounds[0]) / side_) + 1,
                 static_cast<int>((bounds[3] - bounds[1]) / side_) + 1};
  table_.reserve(static_cast<std::size_t>(table_size_.area()));
  for (int y = 0; y < table_size_.height; ++y) {
    for (int x = 0; x < table_size_.width; ++x) {
      const Eigen::Vector2d distorted =
          camera.distort({bounds[0] + (x + 0.5) * side_, bounds[1] + (y + 0.5) * side_});
      const bool inside = distorted.x() >= 0.0 && distorted.y() >= 0.0 && distorted.x() < camera.width &&
                          distorted.y() < camera.height;
      table_.push_back(inside ? static_cast<int>(distorted.y() / side_) * size_.width +
                                    static_cast<int>(distorted.x() / side_)
                              : -1);
    }
  }
}

cv::Point CellGrid::pixel_of(const cv::Point& cell) const {
  return {std::min(cell.x * side_ + side_ / 2, camera_.width - 1),
          std::min(cell.y * side_ + side_ / 2, camera_.height - 1)};
}

cv::Point CellGrid::cell_of(const cv::Point2f& pixel) const {
  return {std::clamp(static_cast<int>(pixel.x) / side_, 0, size_.width - 1),
          std::clamp(static_cast<int>(pixel.y) / side_, 0, size_.height - 1)};
}

cv::Mat CellGrid::grey_cells(const cv::Mat& grey) const {
  cv::Mat whole = grey;
  const cv::Size covered = size_ * side_;
  if (covered != grey.size()) {
    cv::copyMakeBorder(grey, whole, 0, covered.height - grey.rows, 0, covered.width - grey.cols,
                       cv::BORDER_REPLICATE);
  }
  cv::Mat cells;
  cv::resize(whole, cells, size_, 0.0, 0.0, cv::INTER_AREA);
  return cells;
}

cv::Mat CellGrid::depth_cells(const cv::Mat& depth, const DepthOptions& options) const {
  cv::Mat cells = cv::Mat::zeros(size_, CV_32FC1);
  if (depth.empty()) return cells;
  for (int y = 0; y < size_.height; ++y) {
    for (int x = 0; x < size_.width; ++x) {
      const cv::Point pixel = pixel_of({x, y});
      cells.at<float>(y, x) =
          depth_at(depth, cv::Point2f(static_cast<float>(pixel.x), static_cast<float>(pixel.y)), options);
    }
  }
  return cells;
}

cv::Mat CellGrid::mask_cells(const cv::Mat& mask, const cv::Rect& area) const {
  cv::Mat cells(area.size(), CV_8UC1);
  const cv::Point origin = area.tl() * side_;
  for (int y = 0; y < area.height; ++y) {
    for (int x = 0; x < area.width; ++x) {
      const cv::Point pixel = pixel_of(area.tl() + cv::Point(x, y)) - origin;
      cells.at<std::uint8_t>(y, x) = mask.at<std::uint8_t>(pixel) != 0 ? 255 : 0;
    }
  }
  return cells;
}

cv::Rect CellGrid::cells_of(const cv::Rect& pixels) const {
  return {cell_of(pixels.tl()), cell_of(pixels.br() - cv::Point(1, 1)) + cv::Point(1, 1)};
}

cv::Rect CellGrid::pixels_of(const cv::Rect& cells) const {
  return cv::Rect(cells.tl() * side_, cells.size() * side_) & cv::Rect(0, 0, camera_.width, camera_.height);
}

cv::Mat CellGrid::in_pixels(const cv::Mat& values, const cv::Rect& cells) const {
  cv::Mat large;
  cv::resize(values, large, cells.size() * side_, 0, 0, cv::INTER_NEAREST);
  return large(cv::Rect({0, 0}, pixels_of(cells).size()));
}

}  // namespace roslam
