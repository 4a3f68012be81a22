// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <opencv2/core.hpp>

#include "roslam/semantics/label_set.hpp"

namespace roslam {

/// What a network says about one picture.
struct Segmentation {
  cv::Mat labels;                            ///< CV_8UC1 of the picture's size: class 0..18 of each pixel
  std::array<float, kClasses> confidence{};  ///< mean probability of each class where it was chosen, 0 where
                                             ///< it has no point of the network's grid
  cv::Mat probability;   ///< CV_32FC1, of the class chosen, on a coarse grid over the picture; may be empty
  double seconds = 0.0;  ///< processor time from picture to labels
};

/// Labels every pixel of a picture. Not safe to call from several threads at once; give each its own.
class Segmenter {
 public:
  Segmenter() = default;
  Segmenter(const Segmenter&) = delete;
  Segmenter& operator=(const Segmenter&) = delete;
  virtual ~Segmenter() = default;

  /// image: CV_8UC3 (BGR), CV_8UC4 (BGRA, alpha is ignored) or CV_8UC1 (grey), of any size. The same image
  /// gives the same labels. Throws InputError for an empty image or another type, ModelError if the network
  /// fails.
  virtual Segmentation segment(const cv::Mat& image) = 0;
};

}  // namespace roslam
