// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "roslam/common/export.hpp"
#include "roslam/geometry/camera.hpp"

namespace roslam {

/// The camera as a ROS camera_info (YAML, as camera_info_manager reads it): plumb_bob, rational_polynomial or
/// equidistant. What a format has no place for (depth units, mount, inertial unit) is a comment at the end of
/// the file, in all three.
ROSLAM_EXPORT std::string camera_to_ros(const Camera& camera);

/// The camera as a Kalibr camchain.yaml with the one camera cam0: radtan or equidistant; T_cam_imu if it has
/// an inertial unit. Throws InputError for a lens with more coefficients than k1 k2 p1 p2.
ROSLAM_EXPORT std::string camera_to_kalibr(const Camera& camera);

/// The camera as OpenCV's FileStorage reads it: camera_matrix, distortion_coefficients, image_width,
/// image_height; fisheye_model is 1 for coefficients of cv::fisheye.
ROSLAM_EXPORT std::string camera_to_opencv(const Camera& camera);

}  // namespace roslam
