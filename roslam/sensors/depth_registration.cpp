// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sensors/depth_registration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "roslam/common/error.hpp"
#include "roslam/common/target_clones.hpp"
#include "roslam/geometry/pixel_distortion.hpp"

namespace roslam {

namespace {
constexpr float kNearest = 1e-3F;  // metres before the colour camera
constexpr float kFarthest = 1e4F;  // metres
constexpr float kUnknown = 1e9F;   // depth of a pixel while nothing is drawn there
constexpr float kFar = 1e6F;       // pixels; what is farther outside is not in the image
constexpr int kLargest = 64;       // pixels that one may cover in each direction; more is no measurement

// The smallest integer that is not less. Written so that a loop over it is vectorised. The limits below have
// the constant first, as NaN then becomes the constant.
[[gnu::always_inline]] inline int round_up(float value) {
  const int truncated = static_cast<int>(value);
  return truncated + (static_cast<float>(truncated) < value ? 1 : 0);
}

ROSLAM_TARGET_CLONES("avx2")
void line_up(float start, float step, std::size_t count, float* out) {
  for (std::size_t i = 0; i < count; ++i) out[i] = start + step * static_cast<float>(static_cast<int>(i));
}

// Where points on rays are in the colour image, before distortion.
ROSLAM_TARGET_CLONES("avx2")
void project_points(const float* depth, const float* ray_x, const float* ray_y, const float* ray_z,
                    const Eigen::Vector3f& offset, std::size_t count, float* x, float* y) {
  const float ox = offset.x(), oy = offset.y(), oz = offset.z();
  for (std::size_t u = 0; u < count; ++u) {
    const float scale = 1.0F / std::max(kNearest, depth[u] * ray_z[u] + oz);
    x[u] = std::min(kFar, std::max(-kFar, (depth[u] * ray_x[u] + ox) * scale));
    y[u] = std::min(kFar, std::max(-kFar, (depth[u] * ray_y[u] + oy) * scale));
  }
}

// Of points that are known, z; of others 0.
ROSLAM_TARGET_CLONES("avx2")
void depth_of_points(const float* depth, const float* above_z, const float* below_z, float offset,
                     std::size_t count, float* z) {
  for (std::size_t u = 0; u < count; ++u) {
    const float at = depth[u] * (0.5F * (above_z[u] + below_z[u])) + offset;
    z[u] = depth[u] > 0.0F && at > kNearest && at < kFarthest ? at : 0.0F;
  }
}

// The pixels that are between two corners, in one direction: first and number.
ROSLAM_TARGET_CLONES("avx2")
void cover(const float* a, const float* b, float seam, int size, std::size_t count, int* first, int* number) {
  for (std::size_t u = 0; u < count; ++u) {
    // The order of the corners changes where one camera is turned against the other.
    const int begin = round_up(std::min(a[u], b[u]) - seam), end = round_up(std::max(a[u], b[u]) + seam);
    const int inside = std::min(std::max(begin, 0), size);
    const int inside_end = std::max(std::min(end, size), inside);
    first[u] = inside;
    number[u] = end - begin > kLargest ? 0 : inside_end - inside;  // more: a corner is beyond the lens
  }
}

// Draws a depth where nothing nearer is.
[[gnu::always_inline]] inline void draw(float z, int width, int height, std::ptrdiff_t stride, float* at) {
  const auto set = [z](float& pixel) { pixel = std::min(pixel, z); };
  if (width <= 2 && height <= 2) {  // nearly always, and without branches
    float* below = height == 2 ? at + stride : at;
    const int last = width - 1;
    set(at[0]);
    set(at[last]);
    set(below[0]);
    set(below[last]);
    return;
  }
  for (int y = 0; y < height; ++y, at += stride)
    for (int x = 0; x < width; ++x) set(at[x]);
}
}  // namespace

// Of a row of pixel corners, planes of their rays.
struct DepthRegistration::Rays {
  const float *x, *y, *z;
};

// Of a row of the depth image, what it becomes in the colour image.
struct DepthRegistration::Row {
  explicit Row(int width)
      : x0(static_cast<std::size_t>(width)),
        y0(x0.size()),
        x1(x0.size()),
        y1(x0.size()),
        z(x0.size()),
        left(x0.size()),
        top(x0.size()),
        columns(x0.size()),
        rows(x0.size()) {}

  std::array<std::vector<float>, 2> rays;     // of even and odd rows of corners
  Rays above{};                               // of the corners above the row
  std::vector<float> x0, y0, x1, y1;          // of the corners of each pixel: top left, and bottom right
  std::vector<float> z;                       // depth in the colour camera, metres; 0: unknown
  std::vector<int> left, top, columns, rows;  // pixels that each covers
};

DepthRegistration::DepthRegistration(const Camera& depth, const Camera& colour, const SE3& T_colour_depth)
    : from_(depth.width, depth.height), to_(colour.width, colour.height) {
  depth.validate();
  colour.validate();
  if (!T_colour_depth.is_finite())
    throw CalibrationError("the transform from the depth to the colour camera is not finite");
  const bool is_one_place = T_colour_depth.translation().norm() < 1e-6 && T_colour_depth.angle() < 1e-6;
  is_identity_ = is_one_place && from_ == to_ && depth.fx == colour.fx && depth.fy == colour.fy &&
                 depth.cx == colour.cx && depth.cy == colour.cy && depth.model == colour.model &&
                 depth.distortion == colour.distortion;
  if (is_identity_) return;
  Eigen::Matrix3d K, depth_K;
  K << colour.fx, 0.0, colour.cx, 0.0, colour.fy, colour.cy, 0.0, 0.0, 1.0;
  depth_K << depth.fx, 0.0, depth.cx, 0.0, depth.fy, depth.cy, 0.0, 0.0, 1.0;
  ray_of_pixel_ = K * T_colour_depth.rotation().toRotationMatrix() * depth_K.inverse();
  offset_ = (K * T_colour_depth.translation()).cast<float>();
  if (depth.has_distortion()) fill_table(depth);
  if (colour.has_distortion()) distortion_ = std::make_shared<PixelDistortion>(colour);
  measure_seams();
}

void DepthRegistration::fill_table(const Camera& depth) {
  const std::size_t columns = static_cast<std::size_t>(depth.width) + 1;
  table_.assign(3 * columns * (static_cast<std::size_t>(depth.height) + 1),
                std::numeric_limits<float>::quiet_NaN());  // where the lens sees nothing
  float* row = table_.data();
  for (int v = 0; v <= depth.height; ++v, row += 3 * columns) {
    for (std::size_t u = 0; u < columns; ++u) {
      const auto pixel = depth.try_undistort({static_cast<double>(u) - 0.5, v - 0.5});
      if (!pixel) continue;
      const Eigen::Vector3f ray = (ray_of_pixel_ * pixel->homogeneous()).cast<float>();
      for (std::size_t i = 0; i < 3; ++i) row[i * columns + u] = ray[static_cast<Eigen::Index>(i)];
    }
  }
}

// The rays of the corners above a row of pixels. memory: where they are put, if there is no table.
DepthRegistration::Rays DepthRegistration::corners(int row, std::vector<float>& memory) const {
  const std::size_t columns = static_cast<std::size_t>(from_.width) + 1;
  const float* begin = table_.data() + 3 * columns * static_cast<std::size_t>(row);
  if (table_.empty()) {
    memory.resize(3 * columns);
    const Eigen::Vector3f start = (ray_of_pixel_ * Eigen::Vector3d(-0.5, row - 0.5, 1.0)).cast<float>();
    const Eigen::Vector3f step = ray_of_pixel_.col(0).cast<float>();
    for (std::size_t i = 0; i < 3; ++i) {
      const auto axis = static_cast<Eigen::Index>(i);
      line_up(start[axis], step[axis], columns, memory.data() + i * columns);
    }
    begin = memory.data();
  }
  return {begin, begin + columns, begin + 2 * columns};
}

// The other two corners of a pixel lie beside the rectangle between those that are projected, by what one
// camera is turned against the other and by distortion; taken at infinity, where the colour camera sees them.
void DepthRegistration::measure_seams() {
  const std::size_t count = static_cast<std::size_t>(from_.width) + 1;
  const std::vector<float> infinity(count, kFarthest);
  std::vector<float> memory, x(count), y(count), x_above, y_above;
  const auto is_seen = [&](std::size_t u) {
    return x_above[u] >= 0.0F && y_above[u] >= 0.0F && x_above[u] < static_cast<float>(to_.width) &&
           y_above[u] < static_cast<float>(to_.height);
  };
  for (int v = 0; v <= from_.height; ++v) {
    locate(infinity.data(), corners(v, memory), x, y);
    for (std::size_t u = 0; v > 0 && u + 1 < count; ++u) {
      if (!is_seen(u)) continue;
      seam_x_ = std::max(seam_x_, std::abs(x_above[u] - x[u]));
      seam_y_ = std::max(seam_y_, std::abs(y_above[u] - y_above[u + 1]));
    }
    x_above = x;
    y_above = y;
  }
  constexpr float kHalf = 0.5F;  // of a pixel that is turned by 90 degrees
  seam_x_ = std::min(seam_x_, kHalf);
  seam_y_ = std::min(seam_y_, kHalf);
}

// Where points on rays are in the colour image.
void DepthRegistration::locate(const float* depth, const Rays& rays, std::vector<float>& x,
                               std::vector<float>& y) const {
  project_points(depth, rays.x, rays.y, rays.z, offset_, x.size(), x.data(), y.data());
  if (distortion_) (*distortion_)(x.size(), x.data(), y.data());
}

void DepthRegistration::project(const float* depth, int row, Row& to) const {
  const auto next = static_cast<std::size_t>(row + 1) % 2;
  const std::size_t count = to.z.size();
  const Rays above = row == 0 ? corners(row, to.rays[0]) : to.above, below = corners(row + 1, to.rays[next]);
  to.above = below;
  locate(depth, above, to.x0, to.y0);
  locate(depth, {below.x + 1, below.y + 1, below.z + 1}, to.x1, to.y1);
  depth_of_points(depth, above.z, below.z + 1, offset_.z(), count, to.z.data());
  cover(to.x0.data(), to.x1.data(), seam_x_, to_.width, count, to.left.data(), to.columns.data());
  cover(to.y0.data(), to.y1.data(), seam_y_, to_.height, count, to.top.data(), to.rows.data());
}

cv::Mat DepthRegistration::operator()(const cv::Mat& depth) const {
  if (depth.type() != CV_32FC1 || depth.size() != from_)
    throw InputError("the depth image is not of the depth camera's size, " + std::to_string(from_.width) +
                     "x" + std::to_string(from_.height));
  if (is_identity_) return depth;
  cv::Mat result(to_, CV_32FC1);
  auto* image = result.ptr<float>();
  std::fill_n(image, result.total(), kUnknown);
  Row row(from_.width);
  for (int v = 0; v < from_.height; ++v) {
    project(depth.ptr<float>(v), v, row);
    for (std::size_t u = 0; u < row.z.size(); ++u) {
      if (row.z[u] > 0.0F && row.columns[u] > 0 && row.rows[u] > 0)
        draw(row.z[u], row.columns[u], row.rows[u], to_.width, image + row.top[u] * to_.width + row.left[u]);
    }
  }
  for (int y = 0; y < result.rows; ++y) {
    float* at = result.ptr<float>(y);
    for (int x = 0; x < result.cols; ++x) at[x] = at[x] < kUnknown ? at[x] : 0.0F;
  }
  return result;
}

}  // namespace roslam
