// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/depth_noise.hpp"
#include "roslam/geometry/imu_calibration.hpp"
#include "roslam/geometry/mount.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// Formula of the lens distortion.
enum class LensModel {
  kPinhole,  ///< radial and tangential (Brown-Conrady), or rational: k1 k2 p1 p2 k3 k4 k5 k6, as OpenCV
  kFisheye,  ///< equidistant (Kannala and Brandt 2006): k1 k2 k3 k4, as OpenCV's fisheye
};

/// "pinhole" or "fisheye".
ROSLAM_EXPORT std::string_view lens_model_name(LensModel model);

/// A camera with lens distortion. Pixels: x right, y down, the centre of the top left pixel at (0, 0). Camera
/// frame: z forward, x right, y down, metres. Undistorted pixels are those of a pinhole with the same fx, fy,
/// cx, cy, also of a fisheye, which is used up to 80 degrees from its axis.
struct ROSLAM_EXPORT Camera {
  int width = 640;                             ///< pixels
  int height = 480;                            ///< pixels
  double fx = 525.0;                           ///< pixels
  double fy = 525.0;                           ///< pixels
  double cx = 319.5;                           ///< pixels
  double cy = 239.5;                           ///< pixels
  LensModel model = LensModel::kPinhole;       ///< of the coefficients below
  std::array<double, 8> distortion{};          ///< in the order of the model, the rest 0
  double depth_units_per_metre = 0.0;          ///< value of a 16-bit depth image at one metre; 0: not set
  double fps = 30.0;                           ///< frames a second
  std::optional<DepthNoise> depth_noise = {};  ///< if known; where images begin to show it that counts
  std::optional<ImuCalibration> imu = {};      ///< of the inertial measurement unit fixed to it, if any
  SE3 T_body_camera = forward_camera();        ///< how it is mounted; the body is x forward, y left, z up
  double baseline = 0.0;  ///< metres along x to the right camera of a rectified stereo pair; 0: no pair

  /// Throws CalibrationError naming the field that is out of range. depth_units_per_metre may be 0 (not set):
  /// depth in metres needs none, and a source of 16-bit depth refuses it.
  void validate() const;

  bool has_distortion() const;

  /// Whether it is the left camera of a rectified stereo pair. The right one has the same pixels' geometry.
  bool is_stereo() const { return baseline > 0.0; }

  /// Whether it is a pinhole with k4, k5 or k6.
  bool is_rational() const;

  /// Sets model and distortion. model: a name; pinhole has 0, 2, 4, 5 or 8 coefficients, fisheye 4. Throws
  /// InputError for another name or number.
  void set_lens(std::string_view model_name, const std::vector<double>& coefficients);

  /// The coefficients as set_lens takes them: 5 or 8 of a pinhole, 4 of a fisheye.
  std::vector<double> coefficients() const;

  /// False if the principal point is so far from the image centre that the calibration may be that of another
  /// size.
  bool has_central_principal_point() const;

  /// Pinhole projection of a point in the camera frame (z > 0) to an undistorted pixel.
  Eigen::Vector2d project(const Eigen::Vector3d& point) const {
    return {fx * point.x() / point.z() + cx, fy * point.y() / point.z() + cy};
  }

  /// The point in the camera frame seen at an undistorted pixel with depth z (metres along the optical axis).
  Eigen::Vector3d unproject(const Eigen::Vector2d& pixel, double z) const {
    return {(pixel.x() - cx) / fx * z, (pixel.y() - cy) / fy * z, z};
  }

  /// Maps an undistorted pixel to the raw (distorted) image. Beyond the angle up to which the lens model is
  /// valid, where its polynomial folds back or a fisheye ends, gives a pixel in the same direction outside
  /// the image, 2 (width + height) from the principal point.
  Eigen::Vector2d distort(const Eigen::Vector2d& pixel) const;

  /// The derivative of distort(), where the model is valid.
  Eigen::Matrix2d distort_jacobian(const Eigen::Vector2d& pixel) const;

  /// Removes lens distortion from a pixel of the raw image (inverse of distort; Newton iteration). Where
  /// there is no inverse, gives the outermost undistorted pixel in the same direction.
  Eigen::Vector2d undistort(const Eigen::Vector2d& pixel) const;

  /// The same, or nothing where there is no inverse: in corners where the polynomial folds back, and beyond
  /// 80 degrees from the axis of a fisheye.
  std::optional<Eigen::Vector2d> try_undistort(const Eigen::Vector2d& pixel) const;

  /// Bounding box of all undistorted pixels of the image: {min_x, min_y, max_x, max_y}. Of a fisheye at most
  /// that of 80 degrees, 5.7 fx and fy to each side of the principal point.
  std::array<double, 4> undistorted_bounds() const;

  bool operator==(const Camera&) const = default;
};

/// The names load_camera knows: 7scenes bonn d435 d455 simulated tum-fr1 tum-fr2 tum-fr3.
ROSLAM_EXPORT std::vector<std::string> camera_preset_names();

/// The preset of that name, or nothing.
ROSLAM_EXPORT std::optional<Camera> camera_preset(std::string_view name);

/// The usual values of depth_units_per_metre, as the remedy of an error message.
ROSLAM_EXPORT std::string_view usual_depth_units();

/// Reads a camera file, of RO-SLAM or as import_camera() takes them (camera_import.hpp). That of RO-SLAM is
/// YAML (model, width, height, fx, fy, cx, cy, distortion, depth_units_per_metre, fps,
/// depth_noise: {constant, growth}, imu: {T_camera_imu: 16 numbers, row by row, gyroscope_noise,
/// gyroscope_walk}, T_body_camera: 16 numbers, row by row, baseline); only model, distortion, fps (30),
/// depth_noise, imu, T_body_camera and baseline (0) have defaults, and with a baseline depth_units_per_metre.
/// distortion: k1 k2 p1 p2 k3, k1 k2 p1 p2, k1 k2, or none. Throws InputError for a missing or malformed file
/// or an unknown key, CalibrationError as validate does.
ROSLAM_EXPORT Camera read_camera(const std::filesystem::path& file);

/// A preset name or a camera file. Throws as read_camera does.
ROSLAM_EXPORT Camera load_camera(const std::string& preset_or_file);

/// Writes what read_camera reads.
ROSLAM_EXPORT std::string camera_to_yaml(const Camera& camera);

}  // namespace roslam
