// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "roslam/cloud/dense_options.hpp"
#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/pixel_rays.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// A picture of the static scene as it is fused: smaller than it was taken, without lens distortion.
struct DenseView {
  Camera camera;        ///< pinhole of the smaller picture
  cv::Mat colour;       ///< CV_8UC3, BGR
  cv::Mat depth;        ///< CV_32FC1 metres, 0 = nothing to fuse
  cv::Mat labels;       ///< CV_8UC1, kVoid = unknown
  cv::Mat provenance;   ///< CV_8UC1, values of Provenance
  cv::Mat beyond = {};  ///< CV_8UC1, nonzero where what is seen lies beyond the reach; may be empty
  double reach = 0.0;   ///< metres up to which depth is fused
};

/// A view in little memory. What is lost (depth is kept in millimetres) is lost before it is fused for the
/// first time, so that to fuse it again gives the same.
struct PackedView {
  Camera camera;
  std::vector<std::uint8_t> colour, depth, marks;
  double reach = 0.0;  ///< metres

  std::size_t bytes() const { return colour.size() + depth.size() + marks.size(); }
};

PackedView pack(const DenseView& view);
DenseView unpack(const PackedView& packed);

/// Makes views from pictures as a camera takes them.
class ViewReducer {
 public:
  ViewReducer(const Camera& camera, const DenseOptions& dense, const DepthOptions& depth);

  /// Without labels. colour: CV_8UC3; depth: CV_32FC1 metres, 0 or NaN = unknown, may be empty; provenance:
  /// CV_8UC1, may be empty, which is all measured; hidden: CV_8UC1, nonzero where nothing is to be fused, may
  /// be empty. All of the camera's size.
  DenseView reduce(const cv::Mat& colour, const cv::Mat& depth, const cv::Mat& provenance,
                   const cv::Mat& hidden) const;

  /// Labels what was measured by a picture taken elsewhere. labels: CV_8UC1 of the camera's size.
  /// T_labelled_camera: from where the view was taken to where the labelled picture was.
  void label(DenseView& view, const cv::Mat& labels, const SE3& T_labelled_camera) const;

  /// Of the pictures as taken.
  const PixelRays& rays() const { return rays_; }

 private:
  DepthOptions depth_;
  PixelRays rays_;  // of the picture as taken
  Camera reduced_;
  PixelRays reduced_rays_;
  cv::Mat map_x_, map_y_;  // where a pixel of the smaller picture lies in the picture as taken
};

}  // namespace roslam
