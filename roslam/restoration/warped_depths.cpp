// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/warped_depths.hpp"

#include <algorithm>
#include <limits>

namespace roslam {

namespace {
// Points of a row of pixels, by coordinate.
struct PointRow {
  explicit PointRow(int width) : x(static_cast<std::size_t>(width)), y(x.size()), z(x.size()) {}
  std::vector<float> x, y, z;
};

// The points that a row of pixels shows at the given depths, moved. The compiler vectorises the loop.
void move_points(const SE3f& motion, const cv::Vec2f* rays, const float* depths, PointRow& points) {
  const Eigen::Matrix3f& R = motion.rotation;
  const Eigen::Vector3f& t = motion.translation;
  const float r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2), t0 = t(0);
  const float r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2), t1 = t(1);
  const float r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2), t2 = t(2);
  float *to_x = points.x.data(), *to_y = points.y.data(), *to_z = points.z.data();
  const float* ray = rays->val;
  for (std::size_t i = 0; i < points.z.size(); ++i) {
    const float z = depths[i], x = ray[2 * i] * z, y = ray[2 * i + 1] * z;
    to_x[i] = r00 * x + (r01 * y + r02 * z) + t0;
    to_y[i] = r10 * x + (r11 * y + r12 * z) + t1;
    to_z[i] = r20 * x + (r21 * y + r22 * z) + t2;
  }
}

}  // namespace

WarpedDepths::WarpedDepths(const PixelRays& rays, const std::vector<SourceWarp>& warps, const cv::Mat& area)
    : sources_(warps.size()), numbers_(cv::Mat::zeros(area.rows + 2, area.cols + 2, CV_32SC1)) {
  int pixels = 0;
  for (int y = 0; y < area.rows; ++y) {
    const auto* is_in_area = area.ptr<std::uint8_t>(y);
    int* numbers = numbers_.ptr<int>(y + 1) + 1;
    for (int x = 0; x < area.cols; ++x)
      if (is_in_area[x] != 0) numbers[x] = ++pixels;
  }
  measured_.assign(static_cast<std::size_t>(pixels + 1) * sources_, std::numeric_limits<float>::infinity());
  completed_ = measured_;
  for (std::size_t i = 0; i < warps.size(); ++i) splat(rays, warps[i], i);
}

void WarpedDepths::splat(const PixelRays& rays, const SourceWarp& warp, std::size_t source) {
  const SourceImage& image = warp.source();
  const std::size_t stride = numbers_.step1();
  PointRow points(image.depth.cols);
  for (int y = 0; y < image.depth.rows; ++y) {
    const float* depths = image.depth.ptr<float>(y);
    const auto* is_measured = image.is_measured.ptr<std::uint8_t>(y);
    move_points(warp.target_from_source(), rays.row(y), depths, points);
    rays.pixels(points.z.size(), points.x.data(), points.y.data(), points.z.data());
    for (std::size_t x = 0; x < points.z.size(); ++x) {
      if (!(points.x[x] >= 0.0F) || depths[x] == 0.0F) continue;
      // A reading is splatted to the four pixels around it, so that a source a little farther away leaves no
      // gaps.
      const int* corner =
          numbers_.ptr<int>(static_cast<int>(points.y[x]) + 1) + static_cast<int>(points.x[x]) + 1;
      const std::array places{corner[0], corner[1], corner[stride], corner[stride + 1]};
      if ((places[0] | places[1] | places[2] | places[3]) == 0) continue;
      std::vector<float>& nearest = is_measured[x] != 0 ? measured_ : completed_;
      for (const int place : places) {
        float& kept = nearest[static_cast<std::size_t>(place) * sources_ + source];
        kept = std::min(kept, points.z[x]);
      }
    }
  }
}

}  // namespace roslam
