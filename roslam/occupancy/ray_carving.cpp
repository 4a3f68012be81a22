// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/occupancy/ray_carving.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace roslam {

namespace {
bool is_measured(const DepthKeyframe& keyframe, int x, int y) {
  return keyframe.depth.at<float>(y, x) > 0.0F &&
         keyframe.provenance.at<std::uint8_t>(y, x) == static_cast<std::uint8_t>(Provenance::kMeasured);
}

// The free part of a pixel's ray, and whether it ends at a surface.
struct Ray {
  double depth = 0.0;  // metres; 0 = not observed
  bool has_end = false;
};

Ray ray_of(const DepthKeyframe& keyframe, int x, int y) {
  if (is_measured(keyframe, x, y)) return {static_cast<double>(keyframe.depth.at<float>(y, x)), true};
  const bool is_beyond = !keyframe.beyond.empty() && keyframe.beyond.at<std::uint8_t>(y, x) != 0;
  return {is_beyond ? keyframe.reach : 0.0, false};
}

// Pixels between rays so that they are at most half a cell apart at the largest depth and miss no cell.
int ray_stride(const DepthKeyframe& keyframe, double resolution) {
  constexpr int kMaxStride = 8;
  double deepest = 0.0;
  for (int y = 0; y < keyframe.depth.rows; ++y)
    for (int x = 0; x < keyframe.depth.cols; ++x) deepest = std::max(deepest, ray_of(keyframe, x, y).depth);
  if (deepest == 0.0) return kMaxStride;
  const double focal = std::min(keyframe.camera.fx, keyframe.camera.fy);
  return static_cast<int>(
      std::clamp(0.5 * resolution * focal / deepest, 1.0, static_cast<double>(kMaxStride)));
}

// Marks cells; caches the last block, as successive cells are mostly in the same one.
class CellMarker {
 public:
  explicit CellMarker(CellSet& cells) : cells_(cells) {}

  bool mark(const Eigen::Vector3i& cell) {
    const BlockKey key = block_of(cell);
    if (block_ == nullptr || key != key_) {
      key_ = key;
      block_ = &cells_[key];  // references stay valid when the map grows
    }
    return roslam::mark(*block_, cell);
  }

 private:
  CellSet& cells_;
  BlockKey key_;
  CellBlock* block_ = nullptr;
};

// The traversal of a line along one axis: the current cell and the line parameter (0 to 1) at which the next
// is entered. One variable for each axis, in registers: arrays indexed by axis take twice as long.
struct AxisTraversal {
  AxisTraversal(double from, double to)
      : cell(static_cast<int>(std::floor(from))),
        last(static_cast<int>(std::floor(to))),
        step(to > from ? 1 : -1),
        t_step(1.0 / std::abs(to - from)),
        t_next(cell == last ? kNever : (cell + (to > from ? 1 : 0) - from) / (to - from)) {}

  void advance() {
    cell += step;
    t_next = cell == last ? kNever : t_next + t_step;  // rounding must not lead past the last cell
  }

  static constexpr double kNever = std::numeric_limits<double>::infinity();
  int cell, last, step;
  double t_step, t_next;
};

// Marks the cells on a line without the last one (Amanatides and Woo 1987). from, to: in cells.
void mark_line(const Eigen::Vector3d& from, const Eigen::Vector3d& to, CellMarker& marker) {
  AxisTraversal x(from.x(), to.x()), y(from.y(), to.y()), z(from.z(), to.z());
  while (x.cell != x.last || y.cell != y.last || z.cell != z.last) {
    marker.mark({x.cell, y.cell, z.cell});
    if (x.t_next < y.t_next && x.t_next < z.t_next) {
      x.advance();
    } else if (y.t_next < z.t_next) {
      y.advance();
    } else {
      z.advance();
    }
  }
}
}  // namespace

bool find_cell(const Eigen::Vector3d& point, double scale, Eigen::Vector3i& cell) {
  const Eigen::Array3d scaled = (point.array() * scale).floor();
  if (!(scaled >= -kFarthestCell).all() || !(scaled < kFarthestCell).all()) return false;
  cell = scaled.cast<int>();
  return true;
}

CellSet cells_seen_through(const DepthKeyframe& keyframe, const SE3& T_world_camera, double resolution) {
  const double scale = 1.0 / resolution;
  CellSet free, ends, rays;
  Eigen::Vector3i cell;
  if (!find_cell(T_world_camera.translation(), scale, cell)) return free;
  CellMarker free_marker(free), end_marker(ends), ray_marker(rays);
  const Eigen::Matrix3d rotation = T_world_camera.rotation().toRotationMatrix();
  const int stride = ray_stride(keyframe, resolution);
  for (int y = 0; y < keyframe.depth.rows; y += stride) {
    for (int x = 0; x < keyframe.depth.cols; x += stride) {
      const Ray ray = ray_of(keyframe, x, y);
      if (ray.depth == 0.0) continue;
      const Eigen::Vector3d end = rotation * keyframe.camera.unproject(Eigen::Vector2d(x, y), ray.depth) +
                                  T_world_camera.translation();
      if (!find_cell(end, scale, cell)) continue;
      if (ray.has_end) end_marker.mark(cell);
      // One ray for each half cell of end points is enough.
      const Eigen::Vector3i half = (end.array() * (2.0 * scale)).floor().cast<int>();
      if (ray_marker.mark(half)) mark_line(T_world_camera.translation() * scale, end * scale, free_marker);
    }
  }
  for (auto& [key, block] : free)
    if (const auto found = ends.find(key); found != ends.end()) block.erase(found->second);
  return free;
}

}  // namespace roslam
