// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/sources/depth_filling.hpp"

#include <cstdlib>
#include <limits>
#include <opencv2/imgproc.hpp>

namespace roslam {
namespace {

// How much a pixel of distance weighs against a grey level of colour: of two alike the nearer counts.
constexpr float kCostOfDistance = 0.2F;

float difference(const cv::Vec3b& a, const cv::Vec3b& b) {
  return static_cast<float>(std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2])) / 3.0F;
}

class Filling {
 public:
  Filling(const cv::Mat& depth, const cv::Mat& colour)
      : depth_(depth), filled_(depth.clone()), cost_(depth.size(), CV_32FC1) {
    cost_.setTo(std::numeric_limits<float>::max());
    cv::blur(colour, smooth_, {5, 5});
  }

  // Walks from a border of the image to the opposite one and hands known depth on to the unknown behind it.
  void sweep(cv::Point at, const cv::Point& step) {
    cv::Point known(-1, -1);
    float distance = 0.0F;
    for (const cv::Rect image({0, 0}, depth_.size()); image.contains(at); at += step) {
      distance += 1.0F;
      if (depth_.at<float>(at) > 0.0F) {
        known = at;
        distance = 0.0F;
      } else if (known.x >= 0) {
        offer(at, known, distance);
      }
    }
  }

  cv::Mat result() const {
    cv::Mat even;
    cv::medianBlur(filled_, even, 5);  // neighbours that chose otherwise by chance
    depth_.copyTo(even, depth_ > 0.0F);
    return even;
  }

 private:
  void offer(const cv::Point& at, const cv::Point& known, float distance) {
    const float cost =
        difference(smooth_.at<cv::Vec3b>(at), smooth_.at<cv::Vec3b>(known)) + kCostOfDistance * distance;
    if (cost >= cost_.at<float>(at)) return;
    cost_.at<float>(at) = cost;
    filled_.at<float>(at) = depth_.at<float>(known);
  }

  const cv::Mat depth_;
  cv::Mat filled_;
  cv::Mat cost_;    // CV_32FC1, of the best offer so far
  cv::Mat smooth_;  // colour
};

}  // namespace

cv::Mat filled_depth(const cv::Mat& depth, const cv::Mat& colour) {
  CV_Assert(depth.type() == CV_32FC1 && colour.type() == CV_8UC3 && colour.size() == depth.size());
  Filling filling(depth, colour);
  for (int y = 0; y < depth.rows; ++y) {
    filling.sweep({0, y}, {1, 0});
    filling.sweep({depth.cols - 1, y}, {-1, 0});
  }
  for (int x = 0; x < depth.cols; ++x) {
    filling.sweep({x, 0}, {0, 1});
    filling.sweep({x, depth.rows - 1}, {0, -1});
  }
  return filling.result();
}

}  // namespace roslam
