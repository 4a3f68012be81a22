// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/cell_grid.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace roslam {

namespace {
constexpr int kColumns = 160;  // of cells, about
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
  table_origin_ = {static_cast<float>(bounds[0]), static_cast<float>(bounds[1])};
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

int CellGrid::cell_that_sees(const Eigen::Vector3f& point) const {
  const float u = static_cast<float>(camera_.fx) * point.x() / point.z() + static_cast<float>(camera_.cx);
  const float v = static_cast<float>(camera_.fy) * point.y() / point.z() + static_cast<float>(camera_.cy);
  const float column = (u - table_origin_.x) / static_cast<float>(side_);
  const float row = (v - table_origin_.y) / static_cast<float>(side_);
  if (!(column >= 0.0F && row >= 0.0F && column < static_cast<float>(table_size_.width) &&
        row < static_cast<float>(table_size_.height))) {
    return -1;
  }
  return table_[static_cast<std::size_t>(static_cast<int>(row) * table_size_.width +
                                         static_cast<int>(column))];
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

cv::Mat CellGrid::mask_cells(const cv::Mat& mask) const {
  cv::Mat cells(size_, CV_8UC1);
  for (int y = 0; y < size_.height; ++y) {
    for (int x = 0; x < size_.width; ++x) {
      cells.at<std::uint8_t>(y, x) = mask.at<std::uint8_t>(pixel_of({x, y})) != 0 ? 255 : 0;
    }
  }
  return cells;
}

cv::Mat CellGrid::in_pixels(const cv::Mat& cells) const {
  cv::Mat large;
  cv::resize(cells, large, size_ * side_, 0, 0, cv::INTER_NEAREST);
  return large(cv::Rect(0, 0, camera_.width, camera_.height)).clone();
}

}  // namespace roslam
