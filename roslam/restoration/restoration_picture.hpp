// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/picture_strip.hpp"
#include "roslam/restoration/static_scene_restorer.hpp"

namespace roslam {

/// Three pictures side by side: as taken with what was removed outlined, restored, and restored with what was
/// seen at other times tinted green and what was invented magenta. taken: CV_8UC3.
cv::Mat restoration_picture(const cv::Mat& taken, const RestoredView& restored);

/// Such pictures of frames spread over a sequence, below one another.
class RestorationStrip {
 public:
  /// Frames from which nothing was removed are passed over.
  void add(const cv::Mat& taken, const RestoredView& restored);

  /// Empty if there is none.
  cv::Mat strip() const;

 private:
  PictureStrip pictures_{6};
};

}  // namespace roslam
