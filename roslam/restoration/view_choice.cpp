// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/view_choice.hpp"

#include <algorithm>
#include <cmath>

namespace roslam {

namespace {
constexpr int kPoints = 150;         // about, of a hole
constexpr float kUsualDepth = 3.0F;  // metres, where nothing is known

float first_known(const cv::Mat& depth, cv::Point at, const cv::Point& step) {
  const cv::Rect image({0, 0}, depth.size());
  for (; image.contains(at); at += step)
    if (depth.at<float>(at) > 0.0F) return depth.at<float>(at);
  return 0.0F;
}

float depth_behind(const cv::Mat& depth, const cv::Point& at) {
  if (depth.empty()) return kUsualDepth;
  float farthest = 0.0F;
  for (const cv::Point& step : {cv::Point(3, 0), cv::Point(-3, 0), cv::Point(0, 3), cv::Point(0, -3)})
    farthest = std::max(farthest, first_known(depth, at, step));
  return farthest > 0.0F ? farthest : kUsualDepth;
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

std::vector<ViewLink> best_links(const std::vector<ViewLink>& links,
                                 const std::vector<Eigen::Vector3f>& points, int count) {
  cv::Mat_<float> worth(static_cast<int>(links.size()), static_cast<int>(points.size()), 0.0F);
  for (int l = 0; l < worth.rows; ++l) {
    for (int p = 0; p < worth.cols; ++p) {
      const ViewLink& link = links[static_cast<std::size_t>(l)];
      const Eigen::Vector3f& point = points[static_cast<std::size_t>(p)];
      const auto sighting = link.look_at(point);
      if (sighting && sighting->is_static) worth(l, p) = link.weight(point, sighting->depth);
    }
  }
  std::vector<ViewLink> chosen;
  std::vector<float> seen(points.size(), 1.0F);  // what one more view of a point is worth
  std::vector<bool> is_taken(links.size(), false);
  while (static_cast<int>(chosen.size()) < count) {
    int best = -1;
    float most = 0.0F;
    for (int l = 0; l < worth.rows; ++l) {
      if (is_taken[static_cast<std::size_t>(l)]) continue;
      float gain = 0.0F;
      for (int p = 0; p < worth.cols; ++p) gain += worth(l, p) * seen[static_cast<std::size_t>(p)];
      if (gain > most) {
        most = gain;
        best = l;
      }
    }
    if (best < 0) break;
    is_taken[static_cast<std::size_t>(best)] = true;
    chosen.push_back(links[static_cast<std::size_t>(best)]);
    for (int p = 0; p < worth.cols; ++p)
      if (worth(best, p) > 0.0F) seen[static_cast<std::size_t>(p)] *= 0.6F;
  }
  return chosen;
}

}  // namespace roslam
