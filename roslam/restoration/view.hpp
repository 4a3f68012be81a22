// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <opencv2/core.hpp>
#include <optional>

#include "roslam/features/observed_frame.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// A picture, what was removed from it and where it was taken.
struct View {
  double timestamp = 0.0;             ///< seconds
  std::optional<SE3> T_world_camera;  ///< nothing where it is not known
  cv::Mat colour;                     ///< CV_8UC3, BGR, as taken
  cv::Mat depth;                      ///< CV_32FC1 metres, 0 = unknown; may be empty
  cv::Mat removed;  ///< CV_8UC1, nonzero where things that may move hide the scene; may be empty
};

inline constexpr std::size_t kGreyLevels = 2;

/// A picture without colour at a half and a quarter of its side (CV_8UC1).
std::array<cv::Mat, kGreyLevels> grey_levels(const cv::Mat& colour);

/// A view of the static scene that others can be filled from.
struct SourceView {
  double timestamp = 0.0;  ///< seconds
  SE3 T_world_camera;
  cv::Mat colour;  ///< CV_8UC3, BGR, as taken
  cv::Mat depth;   ///< CV_32FC1 metres of what is static, guessed where no camera measured it; 0 = unknown
  cv::Mat is_measured;                    ///< CV_8UC1, nonzero where the depth is measured and not at an edge
  cv::Mat is_static;                      ///< CV_8UC1, nonzero where nothing was removed
  std::array<cv::Mat, kGreyLevels> grey;  ///< of colour
};

/// Nonzero (CV_8UC1) where depth (CV_32FC1, metres) is within the limits and no neighbour's differs by more
/// than noise allows: there foreground and background are mixed.
cv::Mat clear_of_edges(const cv::Mat& depth, const DepthOptions& options);

/// Prepares a view: readings that mix foreground and background are dropped, and what is unknown is guessed
/// from its surroundings, well enough to tell where a colour belongs. Nothing without a pose or depth.
std::optional<SourceView> source_view(const View& view, const DepthOptions& options);

}  // namespace roslam
