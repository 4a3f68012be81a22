// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/depth_consistency.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

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

// Noise filter: cells with at least so many votes, if enough among themselves and their eight neighbours have
// as many.
cv::Mat with_support(const cv::Mat& votes, int needed, int cells) {
  cv::Mat result = cv::Mat::zeros(votes.size(), CV_8UC1);
  for (int y = 1; y + 1 < votes.rows; ++y) {
    for (int x = 1; x + 1 < votes.cols; ++x) {
      if (votes.at<std::uint8_t>(y, x) < needed) continue;
      int count = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        const auto* row = votes.ptr<std::uint8_t>(y + dy);
        for (int dx = -1; dx <= 1; ++dx) count += row[x + dx] >= needed ? 1 : 0;
      }
      if (count >= cells) result.at<std::uint8_t>(y, x) = 255;
    }
  }
  return result;
}

bool is_same_surface(float a, float b, float tolerance) { return std::abs(a - b) <= tolerance * b; }

// Marks the blocks with a cell whose depth differs from that of the known cell before it in the row or
// column.
void mark_depth_edges(const cv::Mat& depth, float tolerance, int block, cv::Mat& marked) {
  std::vector<float> above(static_cast<std::size_t>(depth.cols), 0.0F);
  for (int y = 0; y < depth.rows; ++y) {
    const auto* row = depth.ptr<float>(y);
    float left = 0.0F;
    for (int x = 0; x < depth.cols; ++x) {
      const float z = row[x];
      if (z <= 0.0F) continue;
      float& up = above[static_cast<std::size_t>(x)];
      if ((left > 0.0F && !is_same_surface(z, left, tolerance)) ||
          (up > 0.0F && !is_same_surface(z, up, tolerance)))
        marked.at<std::uint8_t>(y / block, x / block) = 1;
      left = up = z;
    }
  }
}
}  // namespace

// Known cells of the current frame with their points, packed so that many are transformed at once.
struct DepthConsistency::PackedCells {
  std::vector<int> cell;
  std::vector<float> x, y, z;   // the point, metres
  std::vector<float> variance;  // of its depth

  void add(int index, const Eigen::Vector3f& ray, float depth, float variance_of_depth) {
    cell.push_back(index);
    x.push_back(ray.x() * depth);
    y.push_back(ray.y() * depth);
    z.push_back(depth);
    variance.push_back(variance_of_depth);
  }
};

struct DepthConsistency::Votes {
  explicit Votes(const cv::Size& size)
      : through(cv::Mat::zeros(size, CV_8UC1)), same(through.clone()), age(cv::Mat::zeros(size, CV_32FC1)) {}

  void copy(int from, int to) {
    for (cv::Mat* votes : {&through, &same}) votes->data[to] = votes->data[from];
    age.ptr<float>()[to] = age.ptr<float>()[from];
  }

  cv::Mat through;  // CV_8UC1 of cells: how many frames saw through the surface
  cv::Mat same;     // CV_8UC1 of cells: how many saw it
  cv::Mat age;      // CV_32FC1 of cells: of the oldest that saw it, seconds
};

float DepthConsistency::variance(float depth) const {
  const auto sigma =
      static_cast<float>(noise_.depth_sigma) + static_cast<float>(noise_.depth_sigma_growth) * depth * depth;
  return sigma * sigma;
}

// The votes of all past frames on those cells.
void DepthConsistency::vote(const CellGrid& grid, const PackedCells& cells, const SE3& T_camera_world,
                            double timestamp, Votes& votes) const {
  const std::size_t count = cells.cell.size();
  std::vector<float> column(count), row(count), z(count);
  const auto relative_tolerance = static_cast<float>(options_.depth_tolerance);
  const SE3 T_world_camera = T_camera_world.inverse();
  for (const PastDepth& past : past_) {
    const SE3 T_past_camera = past.T_camera_world * T_world_camera;
    const Eigen::Matrix3f M = grid.projection() * T_past_camera.rotation().toRotationMatrix().cast<float>();
    const Eigen::Vector3f m = grid.projection() * T_past_camera.translation().cast<float>();
    for (std::size_t i = 0; i < count; ++i) {
      z[i] = M(2, 0) * cells.x[i] + M(2, 1) * cells.y[i] + M(2, 2) * cells.z[i] + m(2);
      const float inverse = 1.0F / z[i];
      column[i] = inverse * (M(0, 0) * cells.x[i] + M(0, 1) * cells.y[i] + M(0, 2) * cells.z[i] + m(0));
      row[i] = inverse * (M(1, 0) * cells.x[i] + M(1, 1) * cells.y[i] + M(1, 2) * cells.z[i] + m(1));
    }
    const auto age = static_cast<float>(timestamp - past.timestamp);
    for (std::size_t i = 0; i < count; ++i) {
      const int seen = z[i] < 0.05F ? -1 : grid.cell_at(column[i], row[i]);
      const float nearest = seen < 0 ? 0.0F : past.nearest.ptr<float>()[seen];
      if (nearest <= 0.0F) continue;
      const float tolerance =
          3.0F * std::sqrt(cells.variance[i] + variance(nearest)) + relative_tolerance * z[i];
      const int cell = cells.cell[i];
      if (z[i] < nearest - tolerance) {
        ++votes.through.data[cell];
      } else if (z[i] <= past.farthest.ptr<float>()[seen] + tolerance) {
        ++votes.same.data[cell];
        votes.age.ptr<float>()[cell] = std::max(votes.age.ptr<float>()[cell], age);
      }
    }
  }
}

// Votes on one cell of each block first. Where its surface and those of the neighbouring blocks were seen and
// never seen through, its votes hold for the other cells of the block that lie on the same surface. Elsewhere
// each cell is voted on, as it is near depth edges: there a moving object covers what was seen through.
DepthConsistency::Votes DepthConsistency::votes_on(const CellGrid& grid, const cv::Mat& depth,
                                                   const SE3& T_camera_world, double timestamp) const {
  constexpr int kBlock = 4;  // cells
  Votes votes(grid.size());
  const cv::Size blocks((depth.cols + kBlock - 1) / kBlock, (depth.rows + kBlock - 1) / kBlock);
  cv::Mat first(blocks, CV_32SC1, cv::Scalar(-1));
  const auto* z_of = depth.ptr<float>();
  const auto for_each_known = [&](const auto& visit) {
    int cell = 0;
    for (int y = 0; y < depth.rows; ++y) {
      for (int x = 0; x < depth.cols; ++x, ++cell) {
        if (z_of[cell] > 0.0F) visit(cell, cv::Point(x / kBlock, y / kBlock));
      }
    }
  };
  PackedCells cells;
  const auto add = [&](int cell) {
    cells.add(cell, grid.ray(static_cast<std::size_t>(cell)), z_of[cell], variance(z_of[cell]));
  };
  for_each_known([&](int cell, const cv::Point& block) {
    if (first.at<int>(block) >= 0) return;
    first.at<int>(block) = cell;
    add(cell);
  });
  vote(grid, cells, T_camera_world, timestamp, votes);
  cv::Mat is_suspect = cv::Mat::zeros(blocks, CV_8UC1);
  for (int i = 0; i < blocks.area(); ++i) {
    const int cell = first.ptr<int>()[i];
    is_suspect.data[i] = cell >= 0 && (votes.through.data[cell] != 0 || votes.same.data[cell] == 0);
  }
  const auto same_surface = static_cast<float>(options_.depth_tolerance);
  mark_depth_edges(depth, same_surface, kBlock, is_suspect);
  cv::dilate(is_suspect, is_suspect, cv::Mat());
  cells = {};
  for_each_known([&](int cell, const cv::Point& block) {
    const int known = first.at<int>(block);
    const bool holds =
        is_suspect.at<std::uint8_t>(block) == 0 && is_same_surface(z_of[cell], z_of[known], same_surface);
    if (holds)
      votes.copy(known, cell);
    else if (cell != known)
      add(cell);
  });
  vote(grid, cells, T_camera_world, timestamp, votes);
  return votes;
}

DepthEvidence DepthConsistency::examine(const CellGrid& grid, const cv::Mat& depth, const SE3& T_camera_world,
                                        double timestamp) const {
  const Votes votes = votes_on(grid, depth, T_camera_world, timestamp);
  DepthEvidence evidence{cv::Mat::zeros(grid.size(), CV_8UC1), votes.age};
  if (past_.empty()) return evidence;
  const int needed = std::min<int>(2, static_cast<int>(past_.size()));
  constexpr int kMinSupport = 5;  // cells
  const cv::Mat moving = with_support(votes.through, needed, kMinSupport);
  for (std::size_t i = 0; i < grid.cells(); ++i) {
    if (moving.data[i] != 0) {
      evidence.state.data[i] = static_cast<std::uint8_t>(MotionEvidence::kMoving);
    } else if (votes.same.data[i] > 0 && votes.through.data[i] == 0) {
      evidence.state.data[i] = static_cast<std::uint8_t>(MotionEvidence::kStatic);
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
