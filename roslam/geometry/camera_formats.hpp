// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/calibration_file.hpp"
#include "roslam/geometry/camera_import.hpp"

namespace roslam {

// Readers of the formats of camera files. number: of the camera in a file with several, from 0. Cameras of
// other programs are returned unchecked, with a width of 0 where the file has no image size. All throw
// InputError; read_own() also CalibrationError.
Camera read_own(const std::filesystem::path& file, const YAML::Node& node);
ImportedCamera read_kalibr(const CalibrationPart& file, int number);
ImportedCamera read_asl(const CalibrationPart& file);
ImportedCamera read_opencv(const CalibrationPart& file, int number);  // and ROS camera_info
ImportedCamera read_orb_slam(const CalibrationPart& file, int number);

/// A camera of a data set in the ASL layout (sensor.yaml), unchecked.
struct AslCamera {
  Camera camera;                     ///< its width is 0 where the file has no image size
  std::optional<SE3> T_body_sensor;  ///< T_BS, if there is one
};
ROSLAM_EXPORT AslCamera read_asl_camera(const CalibrationPart& file);

/// The inertial unit of such a data set: its noise and, unless it is the body, as in EuRoC, its pose.
ROSLAM_EXPORT ImuCalibration read_asl_unit(const CalibrationPart& file, const SE3& T_camera_body);

/// Sets the lens by the name that another program has for its model. Fails for an unknown one.
ROSLAM_EXPORT void set_lens(Camera& camera, const CalibrationPart& file, std::string_view model,
                            std::vector<double> coefficients);

}  // namespace roslam
