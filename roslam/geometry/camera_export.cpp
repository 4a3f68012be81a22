// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/geometry/camera_export.hpp"

#include <algorithm>
#include <iomanip>
#include <sstream>
#include <vector>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr int kDigits = 12;  // as in camera files of RO-SLAM

std::ostringstream stream() {
  std::ostringstream out;
  out.imbue(std::locale::classic());
  out << std::setprecision(kDigits);
  return out;
}

std::string list(const std::vector<double>& values) {
  auto out = stream();
  out << "[";
  for (std::size_t i = 0; i < values.size(); ++i) out << (i > 0 ? ", " : "") << values[i];
  out << "]";
  return out.str();
}

std::vector<double> rows_of(const SE3& transform) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> T = transform.matrix();
  return {T.data(), T.data() + T.size()};
}

std::vector<double> matrix_of(const Camera& camera) {
  return {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1};
}

// What the other formats have no place for.
std::string comments(const Camera& camera, bool has_unit) {
  auto out = stream();
  out << "# Not in this format, keys of a camera file of RO-SLAM:\n# fps: " << camera.fps << "\n";
  if (camera.depth_units_per_metre > 0.0)
    out << "# depth_units_per_metre: " << camera.depth_units_per_metre << "\n";
  if (camera.T_body_camera != forward_camera())
    out << "# T_body_camera: " << list(rows_of(camera.T_body_camera)) << "\n";
  if (camera.imu && !has_unit) {
    out << "# imu: {T_camera_imu: " << list(rows_of(camera.imu->T_camera_imu))
        << ", gyroscope_noise: " << camera.imu->gyroscope_noise
        << ", gyroscope_walk: " << camera.imu->gyroscope_walk << "}\n";
  }
  return out.str();
}

std::string matrix(const char* key, const char* type, std::size_t rows, const std::vector<double>& values) {
  const std::string indent = "\n   ";
  return std::string(key) + ":" + type + indent + "rows: " + std::to_string(rows) + indent +
         "cols: " + std::to_string(values.size() / rows) + indent +
         (*type != '\0' ? "dt: d" + indent : std::string()) + "data: " + list(values) + "\n";
}
}  // namespace

std::string camera_to_ros(const Camera& camera) {
  auto out = stream();
  const auto k = camera.coefficients();
  const bool is_fisheye = camera.model == LensModel::kFisheye;
  out << "image_width: " << camera.width << "\nimage_height: " << camera.height << "\ncamera_name: camera\n"
      << matrix("camera_matrix", "", 3, matrix_of(camera)) << "distortion_model: "
      << (is_fisheye      ? "equidistant"
          : k.size() == 5 ? "plumb_bob"
                          : "rational_polynomial")
      << "\n"
      << matrix("distortion_coefficients", "", 1, k)
      << matrix("rectification_matrix", "", 3, {1, 0, 0, 0, 1, 0, 0, 0, 1})
      << matrix("projection_matrix", "", 3,
                {camera.fx, 0, camera.cx, 0, 0, camera.fy, camera.cy, 0, 0, 0, 1, 0})
      << comments(camera, false);
  return out.str();
}

std::string camera_to_kalibr(const Camera& camera) {
  auto k = camera.coefficients();
  const bool fits = std::all_of(k.begin() + 4, k.end(), [](double value) { return value == 0.0; });
  if (!fits)
    throw InputError(
        "Kalibr's radtan has the coefficients k1 k2 p1 p2 only, and this camera has more; write ros or "
        "opencv");
  k.resize(4);
  auto out = stream();
  out << "cam0:\n  camera_model: pinhole\n  intrinsics: "
      << list({camera.fx, camera.fy, camera.cx, camera.cy})
      << "\n  distortion_model: " << (camera.model == LensModel::kFisheye ? "equidistant" : "radtan")
      << "\n  distortion_coeffs: " << list(k) << "\n  resolution: [" << camera.width << ", " << camera.height
      << "]\n";
  if (camera.imu) {
    out << "  T_cam_imu:\n";
    const auto rows = rows_of(camera.imu->T_camera_imu);
    for (auto row = rows.begin(); row != rows.end(); row += 4) out << "  - " << list({row, row + 4}) << "\n";
  }
  out << "  rostopic: /camera/image_raw\n" << comments(camera, true);
  return out.str();
}

std::string camera_to_opencv(const Camera& camera) {
  const char* type = " !!opencv-matrix";
  auto out = stream();
  out << "%YAML:1.0\n---\nimage_width: " << camera.width << "\nimage_height: " << camera.height << "\n"
      << matrix("camera_matrix", type, 3, matrix_of(camera))
      << matrix("distortion_coefficients", type, 1, camera.coefficients());
  if (camera.model == LensModel::kFisheye) out << "fisheye_model: 1\n";
  out << comments(camera, false);
  return out.str();
}

}  // namespace roslam
