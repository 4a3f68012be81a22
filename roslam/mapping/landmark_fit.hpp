// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/geometry/camera.hpp"
#include "roslam/geometry/reprojection.hpp"
#include "roslam/map/map.hpp"

namespace roslam {

/// True if a position (world frame, metres) lies where that point of the keyframe shows it, outliers
/// excluded.
bool fits(const Map& map, const Keyframe& keyframe, std::uint32_t point, const Eigen::Vector3d& position,
          const Camera& camera, const MeasurementNoise& noise);

}  // namespace roslam
