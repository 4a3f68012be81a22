// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/depth_consistency.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "roslam/common/upper_median.hpp"

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

// The least mean difference between the cells around one of an image and those around one of another, over
// shifts by one cell, which allow for errors of the pose; grey levels. gain: of a against b. Cells outside an
// image do not count.
float difference_around(const cv::Mat& a, const cv::Point& in_a, const cv::Mat& b, const cv::Point& in_b,
                        float gain) {
  const cv::Rect whole({0, 0}, a.size());
  const cv::Rect around(in_a.x - 1, in_a.y - 1, 3, 3);
  float least = std::numeric_limits<float>::infinity();
  for (int y = -1; y <= 1; ++y) {
    for (int x = -1; x <= 1; ++x) {
      const cv::Point shift = in_b - in_a + cv::Point(x, y);
      const cv::Rect common = around & whole & (whole - shift);
      if (common.empty()) continue;
      float sum = 0.0F;
      for (int v = common.y; v < common.y + common.height; ++v) {
        const auto* row_a = a.ptr<std::uint8_t>(v);
        const auto* row_b = b.ptr<std::uint8_t>(v + shift.y) + shift.x;
        for (int u = common.x; u < common.x + common.width; ++u)
          sum += std::abs(static_cast<float>(row_a[u]) - gain * static_cast<float>(row_b[u]));
      }
      least = std::min(least, sum / static_cast<float>(common.area()));
    }
  }
  return least;
}

// Standard deviation of the cells around one, grey levels.
float contrast_around(const cv::Mat& image, const cv::Point& at) {
  cv::Scalar mean, deviation;
  cv::meanStdDev(image(cv::Rect(at.x - 1, at.y - 1, 3, 3) & cv::Rect({0, 0}, image.size())), mean, deviation);
  return static_cast<float>(deviation[0]);
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

// From points of the current camera to z * (column, row, 1) of the grid's table, in a past frame.
struct DepthConsistency::Projection {
  Eigen::Matrix3f M;
  Eigen::Vector3f m;
};

struct DepthConsistency::Votes {
  explicit Votes(const cv::Size& size)
      : through(cv::Mat::zeros(size, CV_8UC1)),
        background(through.clone()),
        same(through.clone()),
        age(cv::Mat::zeros(size, CV_32FC1)) {}

  void copy(int from, int to) {
    for (cv::Mat* votes : {&through, &background, &same}) votes->data[to] = votes->data[from];
    age.ptr<float>()[to] = age.ptr<float>()[from];
  }

  cv::Mat through;     // CV_8UC1 of cells: how many frames saw through the surface
  cv::Mat background;  // CV_8UC1 of cells: how many of these saw the background as it looks now
  cv::Mat same;        // CV_8UC1 of cells: how many saw the surface
  cv::Mat age;         // CV_32FC1 of cells: of the oldest that saw it, seconds
};

float DepthConsistency::variance(float depth) const {
  const float sigma = static_cast<float>(noise_.constant) + static_cast<float>(noise_.growth) * depth * depth;
  return sigma * sigma;
}

// Whether the image of a cell is that of the background, which the past frame saw at that depth.
bool DepthConsistency::shows_background(const CellGrid& grid, int cell, const cv::Mat& grey,
                                        const Projection& to_past, const PastDepth& past,
                                        float background_depth, float gain) const {
  // The point on the ray of the cell that has the depth of the background in the past frame.
  const Eigen::Vector3f along = to_past.M * grid.ray(static_cast<std::size_t>(cell));
  const float distance = (background_depth - to_past.m.z()) / along.z();
  if (!(along.z() > 0.0F) || !(distance > 0.0F)) return false;
  const Eigen::Vector3f point = (along * distance + to_past.m) / background_depth;
  const int seen = grid.cell_at(point.x(), point.y());
  if (seen < 0) return true;  // the past frame cannot tell
  const auto at = [&](int index) { return cv::Point(index % grey.cols, index / grey.cols); };
  // A surface without texture is recognised by its brightness, which has to agree more closely.
  constexpr float kFlat = 6.0F;  // grey levels
  const float limit =
      std::min(kFlat + contrast_around(grey, at(cell)), static_cast<float>(options_.appearance_tolerance));
  return difference_around(grey, at(cell), past.grey, at(seen), gain) < limit;
}

// The votes of all past frames on those cells.
void DepthConsistency::vote(const CellGrid& grid, const PackedCells& cells, const cv::Mat& grey,
                            const SE3& T_camera_world, double timestamp, Votes& votes) const {
  const std::size_t count = cells.cell.size();
  std::vector<float> column(count), row(count), z(count);
  const auto relative_tolerance = static_cast<float>(options_.depth_tolerance);
  const SE3 T_world_camera = T_camera_world.inverse();
  struct SeenThrough {
    int cell;
    float depth;  // of what was seen behind it
  };
  std::vector<SeenThrough> through;
  std::vector<float> ratios;  // of the brightness of cells to that of the past frame where it saw them
  for (const PastDepth& past : past_) {
    const SE3 T_past_camera = past.T_camera_world * T_world_camera;
    const Projection to_past{grid.projection() * T_past_camera.rotation().toRotationMatrix().cast<float>(),
                             grid.projection() * T_past_camera.translation().cast<float>()};
    const auto& [M, m] = to_past;
    for (std::size_t i = 0; i < count; ++i) {
      z[i] = M(2, 0) * cells.x[i] + M(2, 1) * cells.y[i] + M(2, 2) * cells.z[i] + m(2);
      const float inverse = 1.0F / z[i];
      column[i] = inverse * (M(0, 0) * cells.x[i] + M(0, 1) * cells.y[i] + M(0, 2) * cells.z[i] + m(0));
      row[i] = inverse * (M(1, 0) * cells.x[i] + M(1, 1) * cells.y[i] + M(1, 2) * cells.z[i] + m(1));
    }
    const auto age = static_cast<float>(timestamp - past.timestamp);
    const bool compares = !grey.empty() && !past.grey.empty();
    through.clear();
    ratios.clear();
    for (std::size_t i = 0; i < count; ++i) {
      const int seen = z[i] < 0.05F ? -1 : grid.cell_at(column[i], row[i]);
      const float nearest = seen < 0 ? 0.0F : past.nearest.ptr<float>()[seen];
      if (nearest <= 0.0F) continue;
      const float tolerance =
          3.0F * std::sqrt(cells.variance[i] + variance(nearest)) + relative_tolerance * z[i];
      const int cell = cells.cell[i];
      if (z[i] < nearest - tolerance) {
        through.push_back({cell, nearest});
      } else if (z[i] <= past.farthest.ptr<float>()[seen] + tolerance) {
        ++votes.same.data[cell];
        votes.age.ptr<float>()[cell] = std::max(votes.age.ptr<float>()[cell], age);
        if (compares && grey.data[cell] != 255 && past.grey.data[seen] > 0)
          ratios.push_back(static_cast<float>(grey.data[cell]) / static_cast<float>(past.grey.data[seen]));
      }
    }
    // The exposure may have changed.
    const float gain = ratios.empty() ? 1.0F : upper_median(ratios);
    for (const auto& [cell, depth] : through) {
      ++votes.through.data[cell];
      if (compares && shows_background(grid, cell, grey, to_past, past, depth, gain))
        ++votes.background.data[cell];
    }
  }
}

// Votes on one cell of each block first. Where its surface and those of the neighbouring blocks were seen and
// never seen through, its votes hold for the other cells of the block that lie on the same surface. Elsewhere
// each cell is voted on, as it is near depth edges: there a moving object covers what was seen through.
DepthConsistency::Votes DepthConsistency::votes_on(const CellGrid& grid, const CellImages& images,
                                                   const SE3& T_camera_world, double timestamp) const {
  const cv::Mat& depth = images.depth;
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
  vote(grid, cells, images.grey, T_camera_world, timestamp, votes);
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
  vote(grid, cells, images.grey, T_camera_world, timestamp, votes);
  return votes;
}

DepthEvidence DepthConsistency::examine(const CellGrid& grid, const CellImages& cells,
                                        const SE3& T_camera_world, double timestamp) const {
  const Votes votes = votes_on(grid, cells, T_camera_world, timestamp);
  DepthEvidence evidence{cv::Mat::zeros(grid.size(), CV_8UC1), votes.age};
  if (past_.empty()) return evidence;
  const int needed = std::min<int>(2, static_cast<int>(past_.size()));
  constexpr int kMinSupport = 5;  // cells
  cv::Mat through = votes.through.clone();
  through.setTo(0, votes.background * 2.0 > votes.through);
  const cv::Mat moving = with_support(through, needed, kMinSupport);
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

void DepthConsistency::add(const CellImages& cells, const SE3& T_camera_world, double timestamp) {
  while (!past_.empty() && timestamp - past_.front().timestamp > options_.history) past_.pop_front();
  if (!past_.empty() && timestamp - past_.back().timestamp < options_.history_interval) return;
  PastDepth past{timestamp, T_camera_world, {}, {}, cells.grey};
  depth_range(cells.depth, past.nearest, past.farthest);
  past_.push_back(std::move(past));
}

}  // namespace roslam
