// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>

#include "roslam/common/export.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// T_body_camera of a camera in the origin of the body that looks ahead: the body is x forward, y left, z up
/// (REP 103), the camera z forward, x right, y down.
ROSLAM_EXPORT SE3 forward_camera();

/// T_body_camera of a camera that looks ahead and is then turned and moved with its housing. mount: x, y, z
/// (metres, in the body frame), roll, pitch, yaw (degrees, about the body's axes x, y, z, applied in this
/// order): positive pitch looks down, positive yaw to the left. Throws CalibrationError unless all are
/// finite, the camera is within 10 m and the angles are -360 to 360.
ROSLAM_EXPORT SE3 mounted_camera(const std::array<double, 6>& mount);

/// Reads "X,Y,Z,ROLL,PITCH,YAW". Throws CalibrationError for another text, else as mounted_camera().
ROSLAM_EXPORT SE3 mount_from(const std::string& text);

/// The attitude R_world_body of zero yaw whose world z axis is up. up_in_body: against gravity, of any length
/// but zero. Where the body's x axis is vertical, yaw is that of its z axis.
ROSLAM_EXPORT Eigen::Quaterniond level_attitude(const Eigen::Vector3d& up_in_body);

}  // namespace roslam
