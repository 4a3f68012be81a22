// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/cloud/free_space.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace roslam {

namespace {
bool is_reading(const DenseView& view, int x, int y) {
  return view.depth.at<float>(y, x) > 0.0F &&
         view.provenance.at<std::uint8_t>(y, x) == static_cast<std::uint8_t>(Provenance::kMeasured);
}

// Depth up to which a pixel was looked through, and whether there is something there; 0 where nobody looked.
struct Sight {
  double depth = 0.0;  // metres
  bool has_end = false;
};

Sight sight_of(const DenseView& view, int x, int y) {
  if (is_reading(view, x, y)) return {static_cast<double>(view.depth.at<float>(y, x)), true};
  const bool is_beyond = !view.beyond.empty() && view.beyond.at<std::uint8_t>(y, x) != 0;
  return {is_beyond ? view.reach : 0.0, false};
}

// Pixels from one ray to the next so that at the farthest reading they are half a cell apart at most: then no
// cell that is looked through lies between rays.
int ray_stride(const DenseView& view, double resolution) {
  constexpr int kMost = 8;
  double deepest = 0.0;
  for (int y = 0; y < view.depth.rows; ++y)
    for (int x = 0; x < view.depth.cols; ++x) deepest = std::max(deepest, sight_of(view, x, y).depth);
  if (deepest == 0.0) return kMost;
  const double focal = std::min(view.camera.fx, view.camera.fy);
  return static_cast<int>(std::clamp(0.5 * resolution * focal / deepest, 1.0, static_cast<double>(kMost)));
}

// Marks cells, those in a block that was marked last without looking for it again.
class Marker {
 public:
  explicit Marker(CellSet& cells) : cells_(cells) {}

  bool mark(const Eigen::Vector3i& cell) {
    const BlockKey key = block_of(cell);
    if (block_ == nullptr || key != key_) {
      key_ = key;
      block_ = &cells_[key];  // stays where it is when the set grows
    }
    return roslam::mark(*block_, cell);
  }

 private:
  CellSet& cells_;
  BlockKey key_;
  CellBlock* block_ = nullptr;
};

// A line along one axis: in which cell it is, and at which share of it it enters the next. One for each axis,
// in registers: arrays by axis take twice as long.
struct Course {
  Course(double from, double to)
      : cell(static_cast<int>(std::floor(from))),
        last(static_cast<int>(std::floor(to))),
        step(to > from ? 1 : -1),
        apart(1.0 / std::abs(to - from)),
        next(cell == last ? kNever : (cell + (to > from ? 1 : 0) - from) / (to - from)) {}

  void advance() {
    cell += step;
    next = cell == last ? kNever : next + apart;  // rounding must not lead past the last
  }

  static constexpr double kNever = std::numeric_limits<double>::infinity();
  int cell, last, step;
  double apart, next;
};

// Marks the cells on a line, but for the last (Amanatides and Woo 1987). from, to: in cells.
void mark_line(const Eigen::Vector3d& from, const Eigen::Vector3d& to, Marker& marker) {
  Course x(from.x(), to.x()), y(from.y(), to.y()), z(from.z(), to.z());
  while (x.cell != x.last || y.cell != y.last || z.cell != z.last) {
    marker.mark({x.cell, y.cell, z.cell});
    if (x.next < y.next && x.next < z.next) {
      x.advance();
    } else if (y.next < z.next) {
      y.advance();
    } else {
      z.advance();
    }
  }
}
}  // namespace

bool find_cell(const Eigen::Vector3d& point, double scale, Eigen::Vector3i& cell) {
  const Eigen::Array3d place = (point.array() * scale).floor();
  if (!(place >= -kFarthestCell).all() || !(place < kFarthestCell).all()) return false;
  cell = place.cast<int>();
  return true;
}

CellSet cells_seen_through(const DenseView& view, const SE3& T_world_camera, double resolution) {
  const double scale = 1.0 / resolution;
  CellSet free, ends, rays;
  Eigen::Vector3i cell;
  if (!find_cell(T_world_camera.translation(), scale, cell)) return free;
  Marker free_marker(free), end_marker(ends), ray_marker(rays);
  const Eigen::Matrix3d rotation = T_world_camera.rotation().toRotationMatrix();
  const int stride = ray_stride(view, resolution);
  for (int y = 0; y < view.depth.rows; y += stride) {
    for (int x = 0; x < view.depth.cols; x += stride) {
      const Sight sight = sight_of(view, x, y);
      if (sight.depth == 0.0) continue;
      const Eigen::Vector3d end =
          rotation * view.camera.unproject(Eigen::Vector2d(x, y), sight.depth) + T_world_camera.translation();
      if (!find_cell(end, scale, cell)) continue;
      if (sight.has_end) end_marker.mark(cell);
      // Of rays that end within half a cell of each other, one says it all.
      const Eigen::Vector3i half = (end.array() * (2.0 * scale)).floor().cast<int>();
      if (ray_marker.mark(half)) mark_line(T_world_camera.translation() * scale, end * scale, free_marker);
    }
  }
  for (auto& [key, block] : free)
    if (const auto found = ends.find(key); found != ends.end()) block.erase(found->second);
  return free;
}

}  // namespace roslam
