// SPDX-License-Identifier: BSD-3-Clause
#include "evaluation/camera_check/tracked_pair.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace roslam::evaluation {

namespace {
constexpr int kReduction = 4;  // of the depth images
constexpr std::size_t kFewestPoints = 40;

struct Tracks {
  std::vector<cv::Point2f> from, to;
};

// Of those that are found again when tracked back.
Tracks tracked_on(const Tracks& tracks, const cv::Mat& image, const cv::Mat& next) {
  constexpr float kMostApart = 0.5F;  // pixels
  std::vector<cv::Point2f> there, back;
  std::vector<unsigned char> is_found, is_found_back;
  std::vector<float> errors;
  const cv::Size window(15, 15);
  cv::calcOpticalFlowPyrLK(image, next, tracks.to, there, is_found, errors, window, 3);
  cv::calcOpticalFlowPyrLK(next, image, there, back, is_found_back, errors, window, 3);
  const cv::Rect2f inside(2.0F, 2.0F, static_cast<float>(image.cols - 5), static_cast<float>(image.rows - 5));
  Tracks kept;
  for (std::size_t i = 0; i < there.size(); ++i) {
    const cv::Point2f apart = back[i] - tracks.to[i];
    if (!is_found[i] || !is_found_back[i] || std::hypot(apart.x, apart.y) > kMostApart ||
        !inside.contains(there[i]))
      continue;
    kept.from.push_back(tracks.from[i]);
    kept.to.push_back(there[i]);
  }
  return kept;
}

// Every fourth pixel, as interpolation would mix depths.
cv::Mat reduced(const cv::Mat& depth) {
  cv::Mat small(depth.rows / kReduction, depth.cols / kReduction, CV_32FC1);
  for (int y = 0; y < small.rows; ++y)
    for (int x = 0; x < small.cols; ++x)
      small.at<float>(y, x) = depth.at<float>(kReduction * y, kReduction * x);
  return small;
}

std::vector<Eigen::Vector2d> as_pixels(const std::vector<cv::Point2f>& points) {
  std::vector<Eigen::Vector2d> pixels;
  for (const cv::Point2f& point : points) pixels.emplace_back(point.x, point.y);
  return pixels;
}
}  // namespace

std::optional<double> TrackedPair::depth(std::size_t i, const Alignment& alignment) const {
  constexpr double kSteep = 1.12;  // ratio of the largest to the smallest depth around
  const Eigen::Vector2d centre(0.5 * (size.width - 1), 0.5 * (size.height - 1));
  const Eigen::Vector2d shift(alignment.x, alignment.y);
  const Eigen::Vector2d pixel = (centre + (from[i] - centre - shift) / alignment.zoom) / kReduction;
  const cv::Mat& image = depths.at(static_cast<std::size_t>(alignment.lag + EdgeAlignment::kMostLag));
  const int x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  if (x < 1 || y < 1 || x + 1 >= image.cols || y + 1 >= image.rows) return std::nullopt;
  double nearest = INFINITY, farthest = 0.0, sum = 0.0, across = 0.0, down = 0.0;
  for (int row = -1; row <= 1; ++row) {  // a plane through 3 x 3 pixels
    for (int column = -1; column <= 1; ++column) {
      const auto z = static_cast<double>(image.at<float>(y + row, x + column));
      if (!(z > 0.0) || !std::isfinite(z)) return std::nullopt;
      nearest = std::min(nearest, z);
      farthest = std::max(farthest, z);
      sum += z;
      across += column * z;
      down += row * z;
    }
  }
  if (farthest > kSteep * nearest) return std::nullopt;
  return sum / 9.0 + (pixel.x() - x) * across / 6.0 + (pixel.y() - y) * down / 6.0;
}

std::optional<TrackedPair> track_run(const FrameRun& run, std::size_t run_index, TrackDirection direction) {
  constexpr int kMostCorners = 800;
  constexpr double kQuality = 0.003, kDistance = 9.0;  // pixels
  constexpr double kKept = 0.5;                        // share of the corners
  constexpr std::size_t kAround = EdgeAlignment::kMostLag;
  const bool is_forward = direction == TrackDirection::kForward;
  const std::size_t first = is_forward ? kAround : run.size() - 1 - kAround;
  const std::size_t steps = run.size() - 1 - kAround;
  const auto at = [&](std::size_t step) { return is_forward ? first + step : first - step; };
  Tracks tracks;
  cv::goodFeaturesToTrack(run[first].grey, tracks.from, kMostCorners, kQuality, kDistance);
  tracks.to = tracks.from;
  const auto fewest =
      std::max(kFewestPoints, static_cast<std::size_t>(kKept * static_cast<double>(tracks.from.size())));
  std::size_t step = 0;
  while (step < steps && tracks.to.size() >= fewest) {
    Tracks next = tracked_on(tracks, run[at(step)].grey, run[at(step + 1)].grey);
    if (next.to.size() < fewest) break;
    tracks = std::move(next);
    ++step;
  }
  if (step == 0) return std::nullopt;
  TrackedPair pair;
  pair.run = run_index;
  pair.size = run[first].grey.size();
  pair.from = as_pixels(tracks.from);
  pair.to = as_pixels(tracks.to);
  for (std::size_t i = 0; i < pair.depths.size(); ++i)
    pair.depths.at(i) = reduced(run[first - kAround + i].depth);
  const auto& from = run[first].T_world_camera;
  const auto& to = run[at(step)].T_world_camera;
  if (from && to) pair.T_to_from = to->inverse() * *from;
  return pair;
}

}  // namespace roslam::evaluation
