// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

namespace roslam {

/// A rectangle that is larger by so many pixels (or cells) on each side.
inline cv::Rect widened(const cv::Rect& box, int pixels) {
  return {box.tl() - cv::Point(pixels, pixels), box.br() + cv::Point(pixels, pixels)};
}

}  // namespace roslam
