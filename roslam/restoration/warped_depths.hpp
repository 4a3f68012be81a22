// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/restoration/source_warp.hpp"

namespace roslam {

/// The static depth of all source images, forward-warped into an area of the target image. Only pixels of the
/// area are stored, those of all sources next to each other.
class WarpedDepths {
 public:
  /// area: CV_8UC1 of the target's size, nonzero where depth is wanted.
  WarpedDepths(const PixelRays& rays, const std::vector<SourceWarp>& warps, const cv::Mat& area);

  /// Depth of each source at a pixel of the area, metres, infinite = none: measured ...
  std::span<const float> measured(int x, int y) const { return at(measured_, x, y); }
  /// ... or filled in.
  std::span<const float> completed(int x, int y) const { return at(completed_, x, y); }

 private:
  void splat(const PixelRays& rays, const SourceWarp& warp, std::size_t source);
  void splat_row(const PixelRays& rays, const SourceWarp& warp, std::size_t source, int y,
                 const cv::Range& columns);
  bool may_reach_area(const PixelRays& rays, const SourceWarp& warp, const cv::Rect& block,
                      const cv::Vec2f& range) const;

  std::span<const float> at(const std::vector<float>& depths, int x, int y) const {
    return {depths.data() + static_cast<std::size_t>(numbers_.ptr<int>(y + 1)[x + 1]) * sources_, sources_};
  }

  std::size_t sources_;
  cv::Mat numbers_;  // CV_32SC1 with a border of a pixel: the place of a pixel's depths; 0 outside the area
  cv::Mat pixels_before_;  // CV_32SC1, integral image of the area
  std::vector<float> measured_, completed_;
  std::vector<float> x_, y_, z_;  // scratch: the points of a row
};

}  // namespace roslam
