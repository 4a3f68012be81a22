// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/geometry/camera.hpp"

namespace roslam {

/// A camera, and how its file was understood.
struct ROSLAM_EXPORT ImportedCamera {
  Camera camera;                   ///< valid
  std::string format;              ///< in words: "a preset", "a Kalibr camera chain" and so on
  std::vector<std::string> notes;  ///< what the file does not tell and what was not taken from it
};

/// Reads a preset or a camera file of RO-SLAM or another program, recognised by its content: Kalibr's
/// camchain.yaml, a ROS camera_info, sensor.yaml of an ASL folder (EuRoC), OpenCV's FileStorage (YAML or
/// XML), settings of ORB-SLAM2 and 3. FILE#cam1 is the second camera of a file that has several. image_size:
/// width and height in pixels for a file that has none. What such a file does not tell keeps its default:
/// depth_units_per_metre 0 (not set), fps 30. Throws InputError that names the file, its format and what is
/// missing, CalibrationError as Camera::validate() does.
ROSLAM_EXPORT ImportedCamera import_camera(const std::string& preset_or_file,
                                           const std::optional<std::array<int, 2>>& image_size = {});

/// Reads the text of a camera file of RO-SLAM, as camera_to_yaml() writes it. name: for messages. Throws as
/// read_camera() does.
ROSLAM_EXPORT Camera camera_from_yaml(const std::string& text, const std::string& name);

}  // namespace roslam
