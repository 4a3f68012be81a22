// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <string>

#include "roslam/cameras/depth_camera.hpp"
#include "roslam/common/export.hpp"

namespace roslam {

/// Of a camera that is connected. Times are in milliseconds.
struct ROSLAM_EXPORT LiveSourceOptions {
  /// Serial number of the camera; empty: the only one that is connected.
  std::string serial;
  /// Images that are asked for; by USB 2 at most 15 a second.
  DepthCameraMode mode;
  /// Without colour or depth images, after which the camera counts as lost; >= 100.
  std::chrono::milliseconds silence{3000};
  /// Between two attempts to open a camera that was lost; >= 1.
  std::chrono::milliseconds retry{1000};
  /// Attempts in a row that fail though the device is there, after which its hardware is reset; >= 1.
  int attempts_before_reset = 3;
  /// After a reset, until the device has started; >= 1.
  std::chrono::milliseconds after_reset{5000};
  /// To wait for the first colour and the first depth image of all, then to give up; >= 100.
  std::chrono::milliseconds first_image{20000};

  /// Throws OptionsError.
  void validate() const;
};

}  // namespace roslam
