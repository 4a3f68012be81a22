// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/restoration/restoration_options.hpp"
#include "roslam/restoration/source_image.hpp"
#include "roslam/restoration/source_warp.hpp"

namespace roslam {

/// An area of the target image reprojected from source images; all images of the target's size.
struct ReprojectedArea {
  cv::Mat filled;     ///< CV_8UC1, 255 where at least one source shows the static scene
  cv::Mat colour;     ///< CV_8UC3, BGR, at the exposure of the target
  cv::Mat depth;      ///< CV_32FC1 metres; 0 where no source measured it
  cv::Mat age;        ///< CV_32FC1 seconds between the target and the blended sources, weighted mean
  cv::Mat certainty;  ///< CV_32FC1, 0 to 1: weight of the agreeing sources, less where others disagree
};

/// Fills an area of an image by reprojection of source images taken before and after it. Each pixel gets the
/// nearest depth that more sources support than see through; its colour is the weighted mean of the sources
/// that show this surface, without colour outliers. Thread-safe.
class BackgroundReprojection {
 public:
  BackgroundReprojection(const Camera& camera, const ReprojectionOptions& options)
      : rays_(camera), options_(options) {}

  /// area: CV_8UC1, nonzero where the target is to be filled. Nothing is filled if the target's pose is
  /// unknown. Uses at most ReprojectionOptions::views sources, those that show most of the area.
  ReprojectedArea fill(const PosedImage& target, const cv::Mat& area,
                       std::span<const SourceImage* const> sources) const;

 private:
  std::vector<SourceWarp> warps(const PosedImage& target, const cv::Mat& area,
                                std::span<const SourceImage* const> sources) const;

  PixelRays rays_;
  ReprojectionOptions options_;
};

}  // namespace roslam
