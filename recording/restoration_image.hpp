// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "recording/image_strip.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"

namespace roslam::recording {

/// Three images side by side: as taken with removed areas outlined; restored; restored with reprojected
/// pixels tinted green and inpainted ones magenta. taken: CV_8UC3 (BGR).
cv::Mat restoration_image(const cv::Mat& taken, const RestoredImage& restored);

/// restoration_image() of frames spread over a sequence, one below another.
class RestorationStrip {
 public:
  /// Ignores frames without removed pixels.
  void add(const cv::Mat& taken, const RestoredImage& restored);

  /// Empty without images.
  cv::Mat strip() const;

 private:
  ImageStrip images_{6};
};

}  // namespace roslam::recording
