// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dynamic_objects/optical_flow.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>
#include <utility>

namespace roslam {

namespace {
constexpr int kHalved = 480;  // columns of images from which on flow is computed at half the resolution
constexpr int kLevels = 2;    // above the first

// Square blocks of the image, so many along a row, and which of them hold a corner.
class Blocks {
 public:
  Blocks(const Camera& camera, int columns)
      : side_(std::max(1, camera.width / columns)),
        size_(camera.width / side_ + 1, camera.height / side_ + 1) {}

  cv::Mat none() const { return cv::Mat::zeros(size_, CV_8UC1); }

  // False if the block of that pixel was taken before.
  bool take(const cv::Point2f& pixel, cv::Mat& taken) const {
    const cv::Point block(static_cast<int>(pixel.x) / side_, static_cast<int>(pixel.y) / side_);
    return std::exchange(taken.at<std::uint8_t>(block), std::uint8_t{1}) == 0;
  }

 private:
  int side_;
  cv::Size size_;
};

std::vector<cv::Point2f> scaled(std::vector<cv::Point2f> points, float factor) {
  for (cv::Point2f& point : points) point *= factor;
  return points;
}

// Moves the guesses to where the points are found, from that pyramid level on.
std::vector<std::uint8_t> lucas_kanade(const FlowPyramid& from, const FlowPyramid& to,
                                       const std::vector<cv::Point2f>& points,
                                       std::vector<cv::Point2f>& guess, int level) {
  std::vector<std::uint8_t> found;
  if (points.empty()) return found;
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 12, 0.03);
  constexpr double kMinEigenvalue = 1e-3;
  guess = scaled(std::move(guess), 1.0F / from.scale);
  cv::calcOpticalFlowPyrLK(from.levels, to.levels, scaled(points, 1.0F / from.scale), guess, found,
                           cv::noArray(), {from.window, from.window}, level, criteria,
                           cv::OPTFLOW_USE_INITIAL_FLOW, kMinEigenvalue);
  guess = scaled(std::move(guess), to.scale);
  return found;
}
}  // namespace

std::vector<CornerMatch> common_corners(const PastFrame& from, const PastFrame& to) {
  std::vector<CornerMatch> matches;
  auto past = from.corners.begin();
  for (const Corner& corner : to.corners) {
    while (past != from.corners.end() && past->track < corner.track) ++past;
    if (past == from.corners.end()) break;
    if (past->track == corner.track) matches.push_back({&*past, &corner});
  }
  return matches;
}

FlowPyramid flow_pyramid(const cv::Mat& grey) {
  FlowPyramid pyramid;
  pyramid.image = grey.size();
  cv::Mat first = grey;
  // Flow is compared within more than a pixel, for which half the resolution of usual images suffices.
  if (grey.cols >= kHalved) {
    cv::pyrDown(grey, first);
    pyramid.scale = 2.0F;
    pyramid.window = 9;
  }
  cv::buildOpticalFlowPyramid(first, pyramid.levels, {pyramid.window, pyramid.window}, kLevels, true);
  return pyramid;
}

std::vector<std::optional<cv::Point2f>> track_points(const FlowPyramid& from, const FlowPyramid& to,
                                                     const std::vector<cv::Point2f>& points,
                                                     const std::vector<cv::Point2f>& guess) {
  std::vector<cv::Point2f> forward = guess;
  const auto found = lucas_kanade(from, to, points, forward, kLevels);
  const cv::Rect2f image(0.0F, 0.0F, static_cast<float>(to.image.width), static_cast<float>(to.image.height));
  std::vector<std::optional<cv::Point2f>> result(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (found[i] != 0 && image.contains(forward[i])) result[i] = forward[i];
  }
  return result;
}

std::vector<float> return_errors(const FlowPyramid& from, const FlowPyramid& to,
                                 const std::vector<CornerMatch>& matches) {
  std::vector<cv::Point2f> found;
  std::vector<cv::Point2f> backward;
  for (const CornerMatch& match : matches) {
    found.push_back(match.to->pixel);
    backward.push_back(match.from->pixel);
  }
  // It starts near its solution, so that the finest level suffices.
  const auto returned = lucas_kanade(to, from, found, backward, 0);
  std::vector<float> errors(matches.size(), std::numeric_limits<float>::infinity());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const cv::Point2f error = backward[i] - matches[i].from->pixel;
    if (returned[i] != 0) errors[i] = std::hypot(error.x, error.y);
  }
  return errors;
}

void CornerSelection::replenish(std::vector<Corner>& corners, const std::vector<cv::Point2f>& points,
                                bool is_removed) {
  const Blocks fine(camera_, 80);
  // Corners of objects are denser, as few pixels must show how an object moves.
  const Blocks blocks = is_removed ? fine : Blocks(camera_, 40);
  const std::size_t most = is_removed ? 250 : 400;
  cv::Mat crowded = fine.none();
  cv::Mat taken = blocks.none();
  std::size_t count = 0;
  std::erase_if(corners, [&](const Corner& corner) {
    if (corner.is_removed != is_removed) return false;
    if (count >= most || !fine.take(corner.pixel, crowded)) return true;
    blocks.take(corner.pixel, taken);
    ++count;
    return false;
  });
  std::vector<cv::Point2f> free;
  std::copy_if(points.begin(), points.end(), std::back_inserter(free),
               [&](const cv::Point2f& point) { return blocks.take(point, taken); });
  const std::size_t added = std::min(free.size(), most - count);
  for (std::size_t i = 0; i < added; ++i) {
    const cv::Point2f& pixel = free[i * free.size() / added];  // evenly spaced in their order
    corners.push_back({++last_track_, pixel, camera_.undistort({pixel.x, pixel.y}), is_removed});
  }
}

}  // namespace roslam
