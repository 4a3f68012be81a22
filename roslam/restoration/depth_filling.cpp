// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/depth_filling.hpp"

#include <cstdlib>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <vector>

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

  // Propagates known depth along a row, from the left (step 1) or from the right (step -1).
  void sweep_row(int y, int step) {
    const float* depth = depth_.ptr<float>(y);
    int known = -1;
    for (int x = step > 0 ? 0 : depth_.cols - 1; x >= 0 && x < depth_.cols; x += step) {
      if (depth[x] > 0.0F) {
        known = x;
      } else if (known >= 0) {
        propose({x, y}, {known, y}, std::abs(x - known));
      }
    }
  }

  // Along all columns, from above (step 1) or from below (step -1), row by row.
  void sweep_columns(int step) {
    std::vector<int> known(static_cast<std::size_t>(depth_.cols), -1);  // row
    for (int y = step > 0 ? 0 : depth_.rows - 1; y >= 0 && y < depth_.rows; y += step) {
      const float* depth = depth_.ptr<float>(y);
      for (int x = 0; x < depth_.cols; ++x) {
        int& row = known[static_cast<std::size_t>(x)];
        if (depth[x] > 0.0F) {
          row = y;
        } else if (row >= 0) {
          propose({x, y}, {x, row}, std::abs(y - row));
        }
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
  // distance: pixels.
  void propose(const cv::Point& at, const cv::Point& known, int distance) {
    const float cost =
        difference(smooth_.ptr<cv::Vec3b>(at.y)[at.x], smooth_.ptr<cv::Vec3b>(known.y)[known.x]) +
        kDistanceCost * static_cast<float>(distance);
    float& least = cost_.ptr<float>(at.y)[at.x];
    if (cost >= least) return;
    least = cost;
    filled_.ptr<float>(at.y)[at.x] = depth_.ptr<float>(known.y)[known.x];
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
    propagation.sweep_row(y, 1);
    propagation.sweep_row(y, -1);
  }
  propagation.sweep_columns(1);
  propagation.sweep_columns(-1);
  return propagation.result();
}

}  // namespace roslam
