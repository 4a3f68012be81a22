// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// An image with its pose and the mask of removed objects.
struct PosedImage {
  double timestamp = 0.0;             ///< seconds
  std::optional<SE3> T_world_camera;  ///< nothing if unknown
  cv::Mat colour;                     ///< CV_8UC3, BGR, as taken
  cv::Mat depth;                      ///< CV_32FC1 metres, 0 = unknown; may be empty
  cv::Mat removed;                    ///< CV_8UC1, nonzero where movable objects hide the scene; may be empty
};

inline constexpr std::size_t kGreyLevels = 2;

/// Grey image pyramid at a half and a quarter of the side (CV_8UC1).
std::array<cv::Mat, kGreyLevels> grey_levels(const cv::Mat& colour);

inline constexpr int kDepthBlock = 16;  ///< pixels, side of the blocks of SourceImage::depth_range

/// Least and largest known depth (CV_32FC1, metres, 0 = unknown) in each block of kDepthBlock pixels:
/// CV_32FC2, 0 where none is known.
cv::Mat depth_range_of(const cv::Mat& depth);

/// An image of the static scene that other images are filled from.
struct SourceImage {
  double timestamp = 0.0;  ///< seconds
  SE3 T_world_camera;
  cv::Mat colour;       ///< CV_8UC3, BGR, as taken
  cv::Mat depth;        ///< CV_32FC1 metres of the static scene, filled in where not measured; 0 = unknown
  cv::Mat is_measured;  ///< CV_8UC1, nonzero where depth is measured, away from depth edges
  cv::Mat is_static;    ///< CV_8UC1, nonzero where nothing was removed
  std::array<cv::Mat, kGreyLevels> grey;  ///< of colour
  cv::Mat depth_range;  ///< CV_32FC2, least and largest depth of each block of kDepthBlock pixels; 0 = none
};

/// Nonzero (CV_8UC1) where depth (CV_32FC1, metres) is within the limits and away from depth edges, where
/// readings mix foreground and background. NaN gives 0.
cv::Mat clear_of_edges(const cv::Mat& depth, const DepthOptions& options);

/// Makes a source image: removes readings at depth edges and fills in unknown depth from its surroundings
/// (filled_depth()), accurately enough to reproject colour. Nothing without a pose or measured static depth.
std::optional<SourceImage> prepare_source(const PosedImage& image, const DepthOptions& options);

}  // namespace roslam
