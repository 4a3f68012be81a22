// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/features/descriptor.hpp"
#include "roslam/features/feature_options.hpp"

namespace roslam {

/// A point with its descriptor.
struct ROSLAM_EXPORT OrbFeature {
  cv::Point2f pixel;   ///< in the full-size raw (distorted) image
  int level = 0;       ///< pyramid level it was found on
  float angle = 0.0F;  ///< degrees, orientation of the patch
  Descriptor descriptor{};
  bool is_in_part = false;  ///< as extract() says
};

/// Extracts ORB features (Rublee et al. 2011): FAST corners on an image pyramid, oriented by the intensity
/// centroid and described by rotated BRIEF. Points are spread evenly over levels and over the image: each
/// level has a share of the budget proportional to its side length; within a level, points are picked
/// round-robin from a grid of as many cells as points wanted.
class ROSLAM_EXPORT OrbExtractor {
 public:
  /// Throws OptionsError.
  explicit OrbExtractor(const OrbOptions& options = {});

  /// grey: CV_8UC1. mask: empty, or CV_8UC1 of the same size, nonzero where points are rejected (paper, eq.
  /// 11). The result is ordered by level. removed: if not null, receives the corners rejected by the mask
  /// (pixels of the full-size image), about as dense as the points elsewhere. Throws InputError for another
  /// type or a mask of another size.
  std::vector<OrbFeature> extract(const cv::Mat& grey, const cv::Mat& mask = {},
                                  std::vector<cv::Point2f>* removed = nullptr) const {
    return extract(grey, mask, {}, removed);
  }

  /// The same with points in a part of the mask as well (CV_8UC1, nonzero there; may be empty), about as
  /// dense as elsewhere: OrbFeature::is_in_part. The others are those that there would be without it.
  std::vector<OrbFeature> extract(const cv::Mat& grey, const cv::Mat& mask, const cv::Mat& part,
                                  std::vector<cv::Point2f>* removed) const {
    return extract(pyramid(grey), mask, part, removed);
  }

  /// The same of an image whose pyramid() is known.
  std::vector<OrbFeature> extract(const std::vector<cv::Mat>& pyramid, const cv::Mat& mask,
                                  const cv::Mat& part, std::vector<cv::Point2f>* removed) const;

  /// The image (CV_8UC1) at all levels, finest first. Throws InputError for another type.
  std::vector<cv::Mat> pyramid(const cv::Mat& grey) const;

  /// The mask dilated by mask_margin (CV_8UC1): where points are rejected.
  cv::Mat forbidden(const cv::Mat& mask) const;

  const OrbOptions& options() const { return options_; }
  int levels() const { return options_.levels; }

  /// Ratio of the full image's side to that of a level.
  float scale(int level) const { return scales_[static_cast<std::size_t>(level)]; }

 private:
  // Points in pixels of their levels.
  std::vector<cv::KeyPoint> detect(const std::vector<cv::Mat>& pyramid, const cv::Mat& mask,
                                   const cv::Mat& part, std::vector<cv::Point2f>* removed) const;
  void finish(std::vector<cv::KeyPoint> points, const cv::Mat& image, std::size_t level, bool is_in_part,
              std::vector<cv::KeyPoint>& all) const;
  std::vector<cv::KeyPoint> corners(const cv::Mat& level_image) const;

  OrbOptions options_;
  std::vector<float> scales_;
  std::vector<int> quotas_;  // points wanted at each level
  std::vector<int> circle_;  // half width of the orientation patch, row by row
  cv::Ptr<cv::ORB> describer_;
};

}  // namespace roslam
