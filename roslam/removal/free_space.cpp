// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/removal/free_space.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
constexpr int kAround = 1;  // cells: the pose may be off by so much

// The least and the largest known depth around each cell whose own depth is known.
void depth_range(const cv::Mat& depth, cv::Mat& nearest, cv::Mat& farthest) {
  nearest = cv::Mat::zeros(depth.size(), CV_32FC1);
  farthest = cv::Mat::zeros(depth.size(), CV_32FC1);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      float low = depth.at<float>(y, x);
      float high = low;
      if (low <= 0.0F) continue;
      for (int ny = std::max(0, y - kAround); ny <= std::min(depth.rows - 1, y + kAround); ++ny) {
        const auto* row = depth.ptr<float>(ny);
        for (int nx = std::max(0, x - kAround); nx <= std::min(depth.cols - 1, x + kAround); ++nx) {
          if (row[nx] <= 0.0F) continue;
          low = std::min(low, row[nx]);
          high = std::max(high, row[nx]);
        }
      }
      nearest.at<float>(y, x) = low;
      farthest.at<float>(y, x) = high;
    }
  }
}

struct Votes {
  std::vector<std::uint8_t> through;  // views that saw through a cell's surface
  std::vector<std::uint8_t> same;     // views that saw it
};

// Cells with at least so many voted cells among their eight neighbours and themselves: noise speaks alone.
cv::Mat with_company(const cv::Mat& cells, int needed) {
  cv::Mat result = cv::Mat::zeros(cells.size(), CV_8UC1);
  for (int y = 1; y + 1 < cells.rows; ++y) {
    for (int x = 1; x + 1 < cells.cols; ++x) {
      if (cells.at<std::uint8_t>(y, x) == 0) continue;
      int count = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        const auto* row = cells.ptr<std::uint8_t>(y + dy);
        for (int dx = -1; dx <= 1; ++dx) count += row[x + dx] != 0 ? 1 : 0;
      }
      if (count >= needed) result.at<std::uint8_t>(y, x) = 255;
    }
  }
  return result;
}
}  // namespace

FreeSpaceEvidence FreeSpaceHistory::examine(const CellGrid& grid, const cv::Mat& depth,
                                            const SE3& T_camera_world, double timestamp) const {
  FreeSpaceEvidence evidence{cv::Mat::zeros(grid.size(), CV_8UC1), cv::Mat::zeros(grid.size(), CV_32FC1)};
  Votes votes{std::vector<std::uint8_t>(grid.cells(), 0), std::vector<std::uint8_t>(grid.cells(), 0)};
  const auto* z_of = depth.ptr<float>();
  auto* static_for = evidence.static_for.ptr<float>();
  const SE3 T_world_camera = T_camera_world.inverse();
  for (const View& view : views_) {
    const SE3 T_view_camera = view.T_camera_world * T_world_camera;
    const Eigen::Matrix3f R = T_view_camera.rotation().toRotationMatrix().cast<float>();
    const Eigen::Vector3f t = T_view_camera.translation().cast<float>();
    const auto age = static_cast<float>(timestamp - view.timestamp);
    for (std::size_t i = 0; i < grid.cells(); ++i) {
      if (z_of[i] <= 0.0F) continue;
      const Eigen::Vector3f point = R * (grid.ray(i) * z_of[i]) + t;
      if (point.z() < 0.05F) continue;
      const int cell = grid.cell_that_sees(point);
      if (cell < 0) continue;
      const float nearest = view.nearest.ptr<float>()[cell];
      if (nearest <= 0.0F) continue;
      const double sigma = std::hypot(noise_.sigma_of_depth(z_of[i]), noise_.sigma_of_depth(nearest));
      const auto tolerance = static_cast<float>(3.0 * sigma + options_.depth_tolerance * point.z());
      if (point.z() < nearest - tolerance) {
        ++votes.through[i];
      } else if (point.z() <= view.farthest.ptr<float>()[cell] + tolerance) {
        ++votes.same[i];
        static_for[i] = std::max(static_for[i], age);
      }
    }
  }
  cv::Mat through = cv::Mat::zeros(grid.size(), CV_8UC1);
  const int needed = std::min<int>(2, static_cast<int>(views_.size()));
  for (std::size_t i = 0; i < grid.cells(); ++i) {
    if (needed > 0 && votes.through[i] >= needed) through.ptr<std::uint8_t>()[i] = 255;
  }
  constexpr int kCompany = 5;
  const cv::Mat moving = with_company(through, kCompany);
  for (std::size_t i = 0; i < grid.cells(); ++i) {
    auto& state = evidence.state.ptr<std::uint8_t>()[i];
    if (moving.ptr<std::uint8_t>()[i] != 0) {
      state = static_cast<std::uint8_t>(Evidence::kMoving);
    } else if (votes.same[i] > 0 && votes.through[i] == 0) {
      state = static_cast<std::uint8_t>(Evidence::kStatic);
    }
  }
  return evidence;
}

void FreeSpaceHistory::move_world(const SE3& T_new_old) {
  for (auto& view : views_) view.T_camera_world = view.T_camera_world * T_new_old.inverse();
}

void FreeSpaceHistory::add(const cv::Mat& depth, const SE3& T_camera_world, double timestamp) {
  while (!views_.empty() && timestamp - views_.front().timestamp > options_.history) views_.pop_front();
  if (!views_.empty() && timestamp - views_.back().timestamp < options_.history_interval) return;
  View view{timestamp, T_camera_world, {}, {}};
  depth_range(depth, view.nearest, view.farthest);
  views_.push_back(std::move(view));
}

}  // namespace roslam
