// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/warped_depths.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace roslam {

namespace {
// The points that count pixels in a row show at the given depths, moved. The compiler vectorises the loop.
void move_points(const SE3f& motion, const cv::Vec2f* rays, const float* depths, std::size_t count,
                 float* to_x, float* to_y, float* to_z) {
  const Eigen::Matrix3f& R = motion.rotation;
  const Eigen::Vector3f& t = motion.translation;
  const float r00 = R(0, 0), r01 = R(0, 1), r02 = R(0, 2), t0 = t(0);
  const float r10 = R(1, 0), r11 = R(1, 1), r12 = R(1, 2), t1 = t(1);
  const float r20 = R(2, 0), r21 = R(2, 1), r22 = R(2, 2), t2 = t(2);
  const float* ray = rays->val;
  for (std::size_t i = 0; i < count; ++i) {
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
  cv::integral(area != 0, pixels_before_);
  measured_.assign(static_cast<std::size_t>(pixels + 1) * sources_, std::numeric_limits<float>::infinity());
  completed_ = measured_;
  for (auto* row : {&x_, &y_, &z_}) row->resize(static_cast<std::size_t>(area.cols));
  for (std::size_t i = 0; i < warps.size(); ++i) splat(rays, warps[i], i);
}

// Whether a point of a block of the source, whose depths are in a range, may be projected into the area.
bool WarpedDepths::may_reach_area(const PixelRays& rays, const SourceWarp& warp, const cv::Rect& block,
                                  const cv::Vec2f& range) const {
  constexpr float kNearest = 0.05F;                 // metres
  if (rays.camera().has_distortion()) return true;  // the block has no straight sides
  const auto fx = static_cast<float>(rays.camera().fx), fy = static_cast<float>(rays.camera().fy);
  const auto cx = static_cast<float>(rays.camera().cx), cy = static_cast<float>(rays.camera().cy);
  float left = std::numeric_limits<float>::max(), top = left, right = -left, bottom = -left;
  for (const int x : {block.x, block.br().x - 1}) {
    for (const int y : {block.y, block.br().y - 1}) {
      for (const float depth : {range[0], range[1]}) {
        const Eigen::Vector3f point = warp.target_from_source() * rays.point(x, y, depth);
        if (point.z() <= kNearest) return true;
        const float to_x = fx * point.x() / point.z() + cx, to_y = fy * point.y() / point.z() + cy;
        left = std::min(left, to_x);
        right = std::max(right, to_x);
        top = std::min(top, to_y);
        bottom = std::max(bottom, to_y);
      }
    }
  }
  const auto within = [](float pixel, int size) {
    return static_cast<int>(std::clamp(pixel, 0.0F, static_cast<float>(size)));
  };
  const int columns = pixels_before_.cols - 1, rows = pixels_before_.rows - 1;
  const int x0 = within(left - 2.0F, columns), x1 = within(right + 3.0F, columns);
  const int y0 = within(top - 2.0F, rows), y1 = within(bottom + 3.0F, rows);
  const int *above = pixels_before_.ptr<int>(y0), *below = pixels_before_.ptr<int>(y1);
  return below[x1] - below[x0] - above[x1] + above[x0] > 0;
}

void WarpedDepths::splat(const PixelRays& rays, const SourceWarp& warp, std::size_t source) {
  const SourceImage& image = warp.source();
  const cv::Rect whole({0, 0}, image.depth.size());
  std::vector<cv::Range> runs;  // columns of blocks that may reach the area
  for (int y = 0; y < image.depth_range.rows; ++y) {
    runs.clear();
    for (int x = 0; x < image.depth_range.cols; ++x) {
      const auto& range = image.depth_range.at<cv::Vec2f>(y, x);
      const cv::Rect block = cv::Rect(x * kDepthBlock, y * kDepthBlock, kDepthBlock, kDepthBlock) & whole;
      if (range[0] == 0.0F || !may_reach_area(rays, warp, block, range)) continue;
      if (runs.empty() || runs.back().end != block.x) runs.emplace_back(block.x, block.x);
      runs.back().end = block.br().x;
    }
    for (int row = y * kDepthBlock; row < std::min((y + 1) * kDepthBlock, whole.height); ++row)
      for (const cv::Range& columns : runs) splat_row(rays, warp, source, row, columns);
  }
}

void WarpedDepths::splat_row(const PixelRays& rays, const SourceWarp& warp, std::size_t source, int y,
                             const cv::Range& columns) {
  const auto count = static_cast<std::size_t>(columns.size());
  const float* depths = warp.source().depth.ptr<float>(y) + columns.start;
  const auto* is_measured = warp.source().is_measured.ptr<std::uint8_t>(y) + columns.start;
  move_points(warp.target_from_source(), rays.row(y) + columns.start, depths, count, x_.data(), y_.data(),
              z_.data());
  rays.pixels(count, x_.data(), y_.data(), z_.data());
  const std::size_t stride = numbers_.step1();
  for (std::size_t i = 0; i < count; ++i) {
    if (!(x_[i] >= 0.0F) || depths[i] == 0.0F) continue;
    // A reading is splatted to the four pixels around it, so that a source a little farther away leaves no
    // gaps.
    const int* corner = numbers_.ptr<int>(static_cast<int>(y_[i]) + 1) + static_cast<int>(x_[i]) + 1;
    const std::array places{corner[0], corner[1], corner[stride], corner[stride + 1]};
    if ((places[0] | places[1] | places[2] | places[3]) == 0) continue;
    std::vector<float>& nearest = is_measured[i] != 0 ? measured_ : completed_;
    for (const int place : places) {
      float& kept = nearest[static_cast<std::size_t>(place) * sources_ + source];
      kept = std::min(kept, z_[i]);
    }
  }
}

}  // namespace roslam
