// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>

#include "roslam/common/export.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/sensors/frame_source.hpp"
#include "roslam/stereo/stereo_options.hpp"

namespace roslam {

/// Depth of every pixel by semi-global matching (Hirschmueller, PAMI 2008; OpenCV's StereoSGBM) on a
/// rectified pair of reduced size: the disparities of both images must agree, small patches that differ from
/// their surroundings are removed. Safe to use from several threads.
class ROSLAM_EXPORT DenseStereo {
 public:
  /// camera: of the rectified pair. Throws CalibrationError if it has no baseline, OptionsError.
  DenseStereo(const Camera& camera, const StereoOptions& options);

  /// left: CV_8UC1 or CV_8UC3, right: CV_8UC1, of the camera's size. Returns CV_32FC1 of the same size:
  /// metres along the optical axis, 0 = unknown.
  cv::Mat depth(const cv::Mat& left, const cv::Mat& right) const;

  /// The frame with a depth image, if it has a right image and no depth yet.
  Frame with_depth(Frame frame) const;

 private:
  cv::Mat disparities(const cv::Mat& left, const cv::Mat& right) const;

  Camera camera_;
  StereoOptions options_;
};

/// What the noise of that depth is expected to be.
ROSLAM_EXPORT DepthNoise dense_stereo_noise(const Camera& camera, const StereoOptions& options);

}  // namespace roslam
