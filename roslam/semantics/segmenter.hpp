// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <string>

#include "roslam/common/export.hpp"
#include "roslam/semantics/label_set.hpp"

namespace roslam {

/// Semantic segmentation of one image.
struct ROSLAM_EXPORT Segmentation {
  cv::Mat labels;                            ///< CV_8UC1 of the image's size: class 0..18 of each pixel
  std::array<float, kClasses> confidence{};  ///< mean probability of each class where it was chosen, 0 where
                                             ///< it has no point of the network's grid
  cv::Mat probability;   ///< CV_32FC1, of the chosen class, on a coarse grid over the image; may be empty
  double seconds = 0.0;  ///< processor time from image to labels
};

/// Labels every pixel of an image. Not thread safe; use one instance per thread.
class ROSLAM_EXPORT Segmenter {
 public:
  Segmenter() = default;
  Segmenter(const Segmenter&) = delete;
  Segmenter& operator=(const Segmenter&) = delete;
  virtual ~Segmenter() = default;

  /// image: CV_8UC3 (BGR), CV_8UC4 (BGRA, alpha is ignored) or CV_8UC1 (grey), of any size. The same image
  /// gives the same labels. Throws InputError for an empty image or another type, ModelError if the network
  /// fails.
  virtual Segmentation segment(const cv::Mat& image) = 0;

  /// What runs the network, such as "own (AVX2)"; empty if there is no network.
  virtual std::string backend() const { return {}; }

  /// Why a faster backend was not chosen, for the user; empty if it was.
  virtual std::string note() const { return {}; }
};

}  // namespace roslam
