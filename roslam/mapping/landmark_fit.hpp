// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/estimation/measurement_model.hpp"
#include "roslam/geometry/camera.hpp"
#include "roslam/map/map.hpp"

namespace roslam {

/// True if the reprojection error of a position (world frame, metres) at that point of the keyframe is within
/// outlier_limit() and the position in front of the camera.
bool is_within_outlier_limit(const Map& map, const Keyframe& keyframe, std::uint32_t point,
                             const Eigen::Vector3d& position, const Camera& camera,
                             const MeasurementNoise& noise);

}  // namespace roslam
