// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/restoration/reprojection_options.hpp"
#include "roslam/restoration/view.hpp"
#include "roslam/restoration/view_link.hpp"

namespace roslam {

/// What other views show of an area; all images of the size of the picture.
struct ReprojectedArea {
  cv::Mat filled;     ///< CV_8UC1, 255 where some view shows what is there
  cv::Mat colour;     ///< CV_8UC3, in the light of the target
  cv::Mat depth;      ///< CV_32FC1 metres; 0 where no camera measured it
  cv::Mat age;        ///< CV_32FC1 seconds between the target and the views blended, their weighted mean
  cv::Mat certainty;  ///< CV_32FC1 from 0 to 1: how many views from near by agree
};

/// Fills an area of a picture with what other views, earlier and later ones, saw there. For each pixel the
/// nearest surface is taken that some view measured and that fewer views look through than have it; its
/// colour is blended from the views that show it, those left out whose colour the others contradict.
class BackgroundReprojection {
 public:
  BackgroundReprojection(const Camera& camera, const ReprojectionOptions& options)
      : rays_(camera), options_(options) {}

  /// area: CV_8UC1, nonzero where the target is to be filled. Nothing is filled if the target's pose is not
  /// known. At most ReprojectionOptions::views of the sources are used, those that show most of the area.
  ReprojectedArea fill(const View& target, const cv::Mat& area,
                       std::span<const SourceView* const> sources) const;

 private:
  std::vector<ViewLink> links(const View& target, const cv::Mat& area,
                              std::span<const SourceView* const> sources) const;

  PixelRays rays_;
  ReprojectionOptions options_;
};

}  // namespace roslam
