// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"
#include "roslam/geometry/camera.hpp"

namespace roslam {

/// The right camera of a stereo pair, as calibrated: neither has to be rectified.
struct ROSLAM_EXPORT RightCamera {
  Camera camera;
  SE3 T_left_right;  ///< maps coordinates of the right camera to those of the left; metres

  double baseline() const { return T_left_right.translation().norm(); }  ///< metres

  bool operator==(const RightCamera&) const = default;
};

}  // namespace roslam
