// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/dense/surface_map.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam::recording {

/// What the colour of a rendered point shows.
enum class MapColour {
  kRgb,        ///< the fused camera colour
  kHeight,     ///< low blue, high red
  kClass,      ///< colour of its semantic class
  kProvenance  ///< measured grey, reprojected green, inpainted magenta
};

/// rgb, height, class, provenance; nothing for another name.
std::optional<MapColour> map_colour_from(std::string_view name);
std::vector<std::string> map_colour_names();

/// The virtual camera of a rendering.
struct Viewpoint {
  Camera camera;
  SE3 T_world_camera;
};

/// The up direction of a map (world frame, unit length): the mean normal of its horizontal surfaces, if it
/// has such within 35 degrees of the z axis (the first camera need not have been level); else the z axis.
Eigen::Vector3f up_of(const SurfaceMap& surface);

/// A view of all of the map from above, along up_of(): world x to the right, world y up in the image.
Viewpoint top_view(const SurfaceMap& surface, const cv::Size& size);

/// A view from 2.5 m behind and 1.5 m above a camera, pitched downwards by 0.2 rad.
Viewpoint front_view(const SE3& T_world_camera, const cv::Size& size);

/// Renders the points as squares with a depth test. point_size: metres, side of a square in space. Returns
/// CV_8UC3 (BGR), white where there is no point.
cv::Mat draw_surface(const SurfaceMap& surface, const Viewpoint& view, MapColour colour, double point_size);

}  // namespace roslam::recording
