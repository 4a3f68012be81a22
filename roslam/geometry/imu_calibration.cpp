// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/imu_calibration.hpp"

#include "roslam/common/error.hpp"

namespace roslam {

void ImuCalibration::validate() const {
  constexpr double kFar = 10.0;  // metres; more is a wrong unit
  if (!T_camera_imu.is_finite() || T_camera_imu.translation().norm() > kFar)
    throw CalibrationError("camera calibration: imu.T_camera_imu must be a rigid transform in metres");
  if (!(gyroscope_noise > 0.0 && gyroscope_noise < 1.0))
    throw CalibrationError("camera calibration: imu.gyroscope_noise must be 0 to 1 rad/s/sqrt(Hz)");
  if (!(gyroscope_walk > 0.0 && gyroscope_walk < 1.0))
    throw CalibrationError("camera calibration: imu.gyroscope_walk must be 0 to 1 rad/s^2/sqrt(Hz)");
}

}  // namespace roslam
