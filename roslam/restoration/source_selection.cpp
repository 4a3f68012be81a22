// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/source_selection.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
constexpr int kPoints = 150;           // approximate number for a hole
constexpr float kDefaultDepth = 3.0F;  // metres, without known depth around

float first_known(const cv::Mat& depth, cv::Point at, const cv::Point& step) {
  const cv::Rect image({0, 0}, depth.size());
  for (; image.contains(at); at += step)
    if (depth.at<float>(at) > 0.0F) return depth.at<float>(at);
  return 0.0F;
}

float depth_behind(const cv::Mat& depth, const cv::Point& at) {
  if (depth.empty()) return kDefaultDepth;
  float farthest = 0.0F;
  for (const cv::Point& step : {cv::Point(3, 0), cv::Point(-3, 0), cv::Point(0, 3), cv::Point(0, -3)})
    farthest = std::max(farthest, first_known(depth, at, step));
  return farthest > 0.0F ? farthest : kDefaultDepth;
}
}  // namespace

std::vector<Eigen::Vector3f> hidden_points(const PixelRays& rays, const cv::Mat& area, const cv::Mat& depth) {
  const int pixels = cv::countNonZero(area);
  const int stride = std::max(1, static_cast<int>(std::sqrt(pixels / kPoints)));
  std::vector<Eigen::Vector3f> points;
  for (int y = 0; y < area.rows; y += stride) {
    for (int x = 0; x < area.cols; x += stride) {
      if (area.at<std::uint8_t>(y, x) != 0) points.push_back(rays.point(x, y, depth_behind(depth, {x, y})));
    }
  }
  return points;
}

std::vector<SourceWarp> select_sources(const std::vector<SourceWarp>& warps,
                                       const std::vector<Eigen::Vector3f>& points, int count) {
  cv::Mat_<float> weights(static_cast<int>(warps.size()), static_cast<int>(points.size()), 0.0F);
  for (int w = 0; w < weights.rows; ++w) {
    for (int p = 0; p < weights.cols; ++p) {
      const SourceWarp& warp = warps[static_cast<std::size_t>(w)];
      const Eigen::Vector3f& point = points[static_cast<std::size_t>(p)];
      const auto warped = warp.project(point);
      if (warped && warped->is_static) weights(w, p) = warp.weight(point, warped->depth);
    }
  }
  std::vector<SourceWarp> chosen;
  std::vector<float> marginal(points.size(), 1.0F);  // value of one more source of a point
  std::vector<bool> is_taken(warps.size(), false);
  while (static_cast<int>(chosen.size()) < count) {
    int best = -1;
    float most = 0.0F;
    for (int w = 0; w < weights.rows; ++w) {
      if (is_taken[static_cast<std::size_t>(w)]) continue;
      float gain = 0.0F;
      for (int p = 0; p < weights.cols; ++p) gain += weights(w, p) * marginal[static_cast<std::size_t>(p)];
      if (gain > most) {
        most = gain;
        best = w;
      }
    }
    if (best < 0) break;
    is_taken[static_cast<std::size_t>(best)] = true;
    chosen.push_back(warps[static_cast<std::size_t>(best)]);
    for (int p = 0; p < weights.cols; ++p)
      if (weights(best, p) > 0.0F) marginal[static_cast<std::size_t>(p)] *= 0.6F;
  }
  return chosen;
}

}  // namespace roslam
