// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/depth_filling.hpp"

#include <cstdlib>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace roslam {
namespace {

// Grey levels per pixel of distance: of two similar colours the nearer is taken.
constexpr float kDistanceCost = 0.2F;

float difference(const cv::Vec3b& a, const cv::Vec3b& b) {
  return static_cast<float>(std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2])) / 3.0F;
}

class DepthPropagation {
 public:
  DepthPropagation(const cv::Mat& depth, const cv::Mat& colour)
      : depth_(depth), filled_(depth.clone()), cost_(depth.size(), CV_32FC1) {
    cost_.setTo(std::numeric_limits<float>::max());
    cv::blur(colour, smooth_, {5, 5});
  }

  // Propagates known depth along a line of pixels from one border of the image to the opposite one.
  void sweep(cv::Point at, const cv::Point& step) {
    cv::Point known(-1, -1);
    float distance = 0.0F;
    for (const cv::Rect image({0, 0}, depth_.size()); image.contains(at); at += step) {
      distance += 1.0F;
      if (depth_.at<float>(at) > 0.0F) {
        known = at;
        distance = 0.0F;
      } else if (known.x >= 0) {
        propose(at, known, distance);
      }
    }
  }

  cv::Mat result() const {
    cv::Mat even;
    cv::medianBlur(filled_, even, 5);  // removes isolated pixels that chose another direction
    depth_.copyTo(even, depth_ > 0.0F);
    return even;
  }

 private:
  void propose(const cv::Point& at, const cv::Point& known, float distance) {
    const float cost =
        difference(smooth_.at<cv::Vec3b>(at), smooth_.at<cv::Vec3b>(known)) + kDistanceCost * distance;
    if (cost >= cost_.at<float>(at)) return;
    cost_.at<float>(at) = cost;
    filled_.at<float>(at) = depth_.at<float>(known);
  }

  const cv::Mat depth_;
  cv::Mat filled_;
  cv::Mat cost_;    // CV_32FC1, of the best proposal so far
  cv::Mat smooth_;  // colour
};

}  // namespace

cv::Mat filled_depth(const cv::Mat& depth, const cv::Mat& colour) {
  CV_Assert(depth.type() == CV_32FC1 && colour.type() == CV_8UC3 && colour.size() == depth.size());
  DepthPropagation propagation(depth, colour);
  for (int y = 0; y < depth.rows; ++y) {
    propagation.sweep({0, y}, {1, 0});
    propagation.sweep({depth.cols - 1, y}, {-1, 0});
  }
  for (int x = 0; x < depth.cols; ++x) {
    propagation.sweep({x, 0}, {0, 1});
    propagation.sweep({x, depth.rows - 1}, {0, -1});
  }
  return propagation.result();
}

}  // namespace roslam
