// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/mount.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "roslam/common/error.hpp"

namespace roslam {

SE3 forward_camera() {
  Eigen::Matrix3d R_body_camera;
  R_body_camera << 0, 0, 1,  //
      -1, 0, 0,              //
      0, -1, 0;
  return {R_body_camera, Eigen::Vector3d::Zero()};
}

SE3 mounted_camera(const std::array<double, 6>& mount) {
  constexpr double kFar = 10.0;  // metres; more is a wrong unit
  constexpr double kTurn = 360.0;
  const bool is_near = std::hypot(mount[0], mount[1], mount[2]) <= kFar;
  const bool is_turn =
      std::all_of(mount.begin() + 3, mount.end(), [](double v) { return std::abs(v) <= kTurn; });
  if (!is_near || !is_turn)
    throw CalibrationError(
        "mount of the camera: it must be within 10 m, roll, pitch, yaw -360 to 360 degrees");
  const auto about = [](double degrees, const Eigen::Vector3d& axis) {
    return Eigen::AngleAxisd(degrees * std::numbers::pi / 180.0, axis);
  };
  const Eigen::Quaterniond R = about(mount[5], Eigen::Vector3d::UnitZ()) *
                               about(mount[4], Eigen::Vector3d::UnitY()) *
                               about(mount[3], Eigen::Vector3d::UnitX());
  return SE3(R, {mount[0], mount[1], mount[2]}) * forward_camera();
}

SE3 mount_from(const std::string& text) {
  std::array<double, 6> mount{};
  const char* at = text.data();
  const char* const end = at + text.size();
  bool is_read = true;
  for (std::size_t i = 0; i < mount.size() && is_read; ++i) {
    if (i > 0) is_read = at != end && *at++ == ',';
    const auto [next, error] = std::from_chars(at, end, mount[i]);
    is_read &= error == std::errc();
    at = next;
  }
  if (!is_read || at != end)
    throw CalibrationError("mount of the camera: '" + text +
                           "' is not X,Y,Z,ROLL,PITCH,YAW (metres, degrees), such as 0.1,0,-0.05,0,20,0");
  return mounted_camera(mount);
}

Eigen::Quaterniond level_attitude(const Eigen::Vector3d& up_in_body) {
  const Eigen::Vector3d up = up_in_body.normalized();
  constexpr double kVertical = 0.05;  // sine of the angle below which the x axis gives no heading
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitX();
  if (up.cross(ahead).norm() < kVertical) ahead = -up.x() * Eigen::Vector3d::UnitZ();
  ahead = (ahead - ahead.dot(up) * up).normalized();
  Eigen::Matrix3d R_world_body;
  R_world_body << ahead.transpose(), up.cross(ahead).transpose(), up.transpose();
  return Eigen::Quaterniond(R_world_body);
}

}  // namespace roslam
