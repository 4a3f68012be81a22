// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <opencv2/core.hpp>

namespace roslam {

/// Tells when the automatic exposure of a camera that was just opened has settled: the mean brightness has
/// changed by less than 3 % from image to image three times in a row, or 30 images have come.
class ExposureSettling {
 public:
  void restart() { *this = {}; }

  bool is_settled() const { return is_settled_; }

  /// Looks at the next image; whether it may be used.
  bool look_at(const cv::Mat& pixels) {
    if (is_settled_) return true;
    const cv::Scalar mean = cv::mean(pixels);
    const double brightness = (mean[0] + mean[1] + mean[2]) / 3.0;
    const bool is_steady = images_ > 0 && std::abs(brightness - last_) <= kSteady * (last_ + 1.0);
    steady_ = is_steady ? steady_ + 1 : 0;
    last_ = brightness;
    ++images_;
    is_settled_ = steady_ >= kEnough || images_ > kMostImages;
    return is_settled_;
  }

 private:
  static constexpr double kSteady = 0.03;
  static constexpr int kEnough = 3;
  static constexpr int kMostImages = 30;

  double last_ = 0.0;
  int steady_ = 0;
  int images_ = 0;
  bool is_settled_ = false;
};

}  // namespace roslam
