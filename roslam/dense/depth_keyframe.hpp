// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/dense/dense_options.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/depth_noise.hpp"
#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// A keyframe of the static scene as it is fused: a subsampled, undistorted RGB-D image.
struct DepthKeyframe {
  Camera camera;        ///< of the subsampled image, without distortion
  cv::Mat colour;       ///< CV_8UC3, BGR
  cv::Mat depth;        ///< CV_32FC1 metres, 0 = nothing to fuse
  cv::Mat labels;       ///< CV_8UC1, kVoid = unknown
  cv::Mat provenance;   ///< CV_8UC1, values of Provenance
  cv::Mat beyond = {};  ///< CV_8UC1, nonzero where the surface lies beyond the reach; may be empty
  double reach = 0.0;   ///< metres up to which depth is fused
  std::optional<DepthNoise> noise = {};  ///< where known better than by the options
};

/// A compressed keyframe (colour as JPEG, depth in millimetres). Lossy, so keyframes are packed before they
/// are fused for the first time: re-integration then gives the same map.
struct PackedDepthKeyframe {
  Camera camera;
  std::vector<std::uint8_t> colour, depth, marks;
  double reach = 0.0;  ///< metres
  std::optional<DepthNoise> noise;

  std::size_t bytes() const { return colour.size() + depth.size() + marks.size(); }
};

PackedDepthKeyframe pack(const DepthKeyframe& keyframe);
DepthKeyframe unpack(const PackedDepthKeyframe& packed);

/// Subsamples and undistorts camera images to depth keyframes. Thread-safe.
class DepthKeyframeReducer {
 public:
  DepthKeyframeReducer(const Camera& camera, const DenseOptions& dense, const DepthOptions& depth);

  /// A keyframe without labels. colour: CV_8UC3 (BGR); depth: CV_32FC1 metres, 0 or NaN = unknown, may be
  /// empty; provenance: CV_8UC1, empty: all measured; hidden: CV_8UC1, nonzero where nothing is fused, may be
  /// empty. All of the camera's size.
  DepthKeyframe reduce(const cv::Mat& colour, const cv::Mat& depth, const cv::Mat& provenance,
                       const cv::Mat& hidden) const;

  /// Projects the measured pixels into a labelled image of another pose and takes its labels, without an
  /// occlusion test. labels: CV_8UC1 of the camera's size. T_labelled_camera: keyframe to labelled camera.
  void label(DepthKeyframe& keyframe, const cv::Mat& labels, const SE3& T_labelled_camera) const;

  /// Rays of the full camera image.
  const PixelRays& rays() const { return rays_; }

 private:
  DepthOptions depth_;
  PixelRays rays_;  // of the full image
  Camera reduced_;
  PixelRays reduced_rays_;
  cv::Mat map_x_, map_y_;  // CV_32FC1, position of each subsampled pixel in the full image
};

}  // namespace roslam
