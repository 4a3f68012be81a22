// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <map>
#include <opencv2/core.hpp>
#include <string>

namespace roslam {

/// Stretches the contrast of images that use a small part of their range, such as dark ones: the thresholds
/// of corner detection are absolute, and the segmentation network has learnt well exposed images. The stretch
/// is kept while it fits, so that optical flow sees a constant brightness.
class BrightnessNormaliser {
 public:
  /// Decides on the stretch of a frame. grey: CV_8UC1.
  void update(const cv::Mat& grey);

  /// False if the frame is used as it is.
  bool is_on() const { return !table_.empty(); }

  /// The image (CV_8UC1 or CV_8UC3) of the frame with its contrast stretched; itself if not is_on().
  cv::Mat apply(const cv::Mat& image) const;

  /// What is wrong with the exposure, in words with the remedy, and in how many frames; of a fault that at
  /// least every fifth frame has.
  std::map<std::string, std::size_t> warnings() const;

  /// Frames so far that were dark, and those of little contrast that were not.
  std::size_t dark() const { return dark_; }
  std::size_t flat() const { return flat_; }

 private:
  cv::Mat table_;  // CV_8UC1, 256 values; empty: no stretch
  double gain_ = 1.0;
  double offset_ = 0.0;  // grey value that stays as it is
  std::size_t frames_ = 0;
  std::size_t dark_ = 0;
  std::size_t flat_ = 0;
};

}  // namespace roslam
