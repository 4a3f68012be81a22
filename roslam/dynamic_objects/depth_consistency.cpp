// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/depth_consistency.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
constexpr int kRadius = 1;  // cells; tolerance for the error of the pose

// The least and the largest known depth around each cell whose own depth is known.
void depth_range(const cv::Mat& depth, cv::Mat& nearest, cv::Mat& farthest) {
  nearest = cv::Mat::zeros(depth.size(), CV_32FC1);
  farthest = cv::Mat::zeros(depth.size(), CV_32FC1);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      float low = depth.at<float>(y, x);
      float high = low;
      if (low <= 0.0F) continue;
      for (int ny = std::max(0, y - kRadius); ny <= std::min(depth.rows - 1, y + kRadius); ++ny) {
        const auto* row = depth.ptr<float>(ny);
        for (int nx = std::max(0, x - kRadius); nx <= std::min(depth.cols - 1, x + kRadius); ++nx) {
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
  std::vector<std::uint8_t> through;  // frames that saw through a cell's surface
  std::vector<std::uint8_t> same;     // frames that saw it
};

// Noise filter: set cells with at least so many set ones among themselves and their eight neighbours.
cv::Mat with_support(const cv::Mat& cells, int needed) {
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

DepthEvidence DepthConsistency::examine(const CellGrid& grid, const cv::Mat& depth, const SE3& T_camera_world,
                                        double timestamp) const {
  DepthEvidence evidence{cv::Mat::zeros(grid.size(), CV_8UC1), cv::Mat::zeros(grid.size(), CV_32FC1)};
  Votes votes{std::vector<std::uint8_t>(grid.cells(), 0), std::vector<std::uint8_t>(grid.cells(), 0)};
  const auto* z_of = depth.ptr<float>();
  auto* static_for = evidence.static_for.ptr<float>();
  const SE3 T_world_camera = T_camera_world.inverse();
  for (const PastDepth& past : past_) {
    const SE3 T_past_camera = past.T_camera_world * T_world_camera;
    const Eigen::Matrix3f R = T_past_camera.rotation().toRotationMatrix().cast<float>();
    const Eigen::Vector3f t = T_past_camera.translation().cast<float>();
    const auto age = static_cast<float>(timestamp - past.timestamp);
    for (std::size_t i = 0; i < grid.cells(); ++i) {
      if (z_of[i] <= 0.0F) continue;
      const Eigen::Vector3f point = R * (grid.ray(i) * z_of[i]) + t;
      if (point.z() < 0.05F) continue;
      const int cell = grid.cell_that_sees(point);
      if (cell < 0) continue;
      const float nearest = past.nearest.ptr<float>()[cell];
      if (nearest <= 0.0F) continue;
      const double sigma = std::hypot(noise_.sigma_of_depth(z_of[i]), noise_.sigma_of_depth(nearest));
      const auto tolerance = static_cast<float>(3.0 * sigma + options_.depth_tolerance * point.z());
      if (point.z() < nearest - tolerance) {
        ++votes.through[i];
      } else if (point.z() <= past.farthest.ptr<float>()[cell] + tolerance) {
        ++votes.same[i];
        static_for[i] = std::max(static_for[i], age);
      }
    }
  }
  cv::Mat through = cv::Mat::zeros(grid.size(), CV_8UC1);
  const int needed = std::min<int>(2, static_cast<int>(past_.size()));
  for (std::size_t i = 0; i < grid.cells(); ++i) {
    if (needed > 0 && votes.through[i] >= needed) through.ptr<std::uint8_t>()[i] = 255;
  }
  constexpr int kMinSupport = 5;  // cells
  const cv::Mat moving = with_support(through, kMinSupport);
  for (std::size_t i = 0; i < grid.cells(); ++i) {
    auto& state = evidence.state.ptr<std::uint8_t>()[i];
    if (moving.ptr<std::uint8_t>()[i] != 0) {
      state = static_cast<std::uint8_t>(MotionEvidence::kMoving);
    } else if (votes.same[i] > 0 && votes.through[i] == 0) {
      state = static_cast<std::uint8_t>(MotionEvidence::kStatic);
    }
  }
  return evidence;
}

void DepthConsistency::apply_correction(const SE3& T_new_old) {
  for (auto& past : past_) past.T_camera_world = past.T_camera_world * T_new_old.inverse();
}

void DepthConsistency::add(const cv::Mat& depth, const SE3& T_camera_world, double timestamp) {
  while (!past_.empty() && timestamp - past_.front().timestamp > options_.history) past_.pop_front();
  if (!past_.empty() && timestamp - past_.back().timestamp < options_.history_interval) return;
  PastDepth past{timestamp, T_camera_world, {}, {}};
  depth_range(depth, past.nearest, past.farthest);
  past_.push_back(std::move(past));
}

}  // namespace roslam
