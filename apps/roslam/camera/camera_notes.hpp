// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace roslam::app {

/// What a user has to know of a preset.
inline std::vector<std::string> preset_notes(const std::string& name) {
  if (name != "d455") return {};
  return {
      "this preset has no lens distortion. The colour lens of a real D455 has some, 2 to 4 pixels towards "
      "the corners at 640x480, and each camera its own focal length: take both from its camera_info, from "
      "the SDK or from a calibration with Kalibr or OpenCV, and give that file as the camera"};
}

}  // namespace roslam::app
