// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/cloud/surface.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// What the colour of a point shows.
enum class MapColour {
  kRgb,        ///< the point as the camera saw it
  kHeight,     ///< low blue, high red
  kClass,      ///< its label
  kProvenance  ///< measured grey, reprojected green, invented magenta
};

/// rgb, height, class, provenance; nothing for another name.
std::optional<MapColour> map_colour_from(std::string_view name);
std::vector<std::string> map_colour_names();

/// Where a map is looked at from.
struct MapView {
  Camera camera;
  SE3 T_world_camera;
};

/// The direction that is up in a map: that of its level surfaces, where it has such within 35 degrees of the
/// world's z axis, for the first camera need not have been level; else the z axis. Unit length.
Eigen::Vector3f up_of(const Surface& surface);

/// From straight above, all of the map in the picture: the world's x to the right, y up, as far as the map is
/// level.
MapView top_view(const Surface& surface, const cv::Size& size);

/// From above and behind a camera that looked at the map, in the direction it looked.
MapView front_view(const SE3& T_world_camera, const cv::Size& size);

/// Draws the points as small squares of the size they have in space, the nearest in front. point_size:
/// metres. CV_8UC3, BGR, white where there is nothing.
cv::Mat draw_surface(const Surface& surface, const MapView& view, MapColour colour, double point_size);

}  // namespace roslam
