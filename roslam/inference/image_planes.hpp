// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace roslam {

/// Writes an image (CV_8UC3, BGR) to the first three planes of a network's input (CV_32F, 1 x 3 or more x
/// rows x columns of the image): RGB from 0 to 1.
inline void write_rgb_planes(const cv::Mat& image, cv::Mat& input) {
  cv::Mat plane;
  for (int c = 0; c < 3; ++c) {
    cv::extractChannel(image, plane, 2 - c);
    plane.convertTo(cv::Mat(image.size(), CV_32F, input.ptr<float>(0, c)), CV_32F, 1.0 / 255.0);
  }
}

}  // namespace roslam
