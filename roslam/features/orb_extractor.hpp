// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <vector>

#include "roslam/features/descriptor.hpp"

namespace roslam {

struct OrbOptions {
  int features = 1000;         ///< points wanted in an image
  int levels = 8;              ///< pyramid levels
  double scale_factor = 1.2;   ///< size ratio between levels
  int fast_threshold = 20;     ///< grey levels a corner must stand out by
  int min_fast_threshold = 7;  ///< grey levels, tried where a cell has no corner at fast_threshold
  int cell_size = 64;          ///< pixels, side of the cells the threshold adapts in
  int mask_margin = 4;         ///< pixels around masked pixels that give no point either

  /// Throws OptionsError naming the field.
  void validate() const;
};

/// A point with its descriptor.
struct OrbFeature {
  cv::Point2f pixel;   ///< in the full-size image as taken
  int level = 0;       ///< pyramid level it was found on
  float angle = 0.0F;  ///< degrees, orientation of the patch
  Descriptor descriptor{};
};

/// Extracts ORB features (Rublee et al. 2011): FAST corners on an image pyramid, oriented by the intensity
/// centroid and described by rotated BRIEF. Points are spread evenly over levels and over the image: each
/// level has a share of the budget by its side length, and within a level a grid of as many cells as points
/// wanted is served in turns.
class OrbExtractor {
 public:
  /// Throws OptionsError.
  explicit OrbExtractor(const OrbOptions& options = {});

  /// grey: CV_8UC1. mask: empty, or CV_8UC1 of the same size, nonzero where no point may come from (eq. 11).
  /// The result is ordered by level. removed: if not null, takes the corners that would have been points but
  /// for the mask (pixels of the full-size image), about as dense as points are elsewhere. Throws InputError
  /// for another type or a mask of another size.
  std::vector<OrbFeature> extract(const cv::Mat& grey, const cv::Mat& mask = {},
                                  std::vector<cv::Point2f>* removed = nullptr) const;

  /// Where a mask lets no point be: the mask with mask_margin around it. CV_8UC1.
  cv::Mat forbidden(const cv::Mat& mask) const;

  const OrbOptions& options() const { return options_; }
  int levels() const { return options_.levels; }

  /// Ratio of the full image's side to that of a level.
  float scale(int level) const { return scales_[static_cast<std::size_t>(level)]; }

 private:
  // Points in pixels of their levels.
  std::vector<cv::KeyPoint> detect(const std::vector<cv::Mat>& pyramid, const cv::Mat& mask,
                                   std::vector<cv::Point2f>* removed) const;
  std::vector<cv::KeyPoint> corners(const cv::Mat& level_image) const;

  OrbOptions options_;
  std::vector<float> scales_;
  std::vector<int> quotas_;  // points wanted at each level
  std::vector<int> circle_;  // half width of the orientation patch, row by row
  cv::Ptr<cv::ORB> describer_;
};

}  // namespace roslam
