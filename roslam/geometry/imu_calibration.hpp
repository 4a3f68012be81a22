// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// An inertial measurement unit (IMU) that is fixed to the camera. Its clock is the camera's.
struct ROSLAM_EXPORT ImuCalibration {
  SE3 T_camera_imu;               ///< maps coordinates in the frame of the IMU to the camera frame
  double gyroscope_noise = 2e-3;  ///< density of the white noise of turn rates, rad/s/sqrt(Hz)
  double gyroscope_walk = 5e-5;   ///< density of the random walk of their bias, rad/s^2/sqrt(Hz)

  /// Throws CalibrationError naming the field that is out of range.
  void validate() const;

  bool operator==(const ImuCalibration&) const = default;
};

}  // namespace roslam
