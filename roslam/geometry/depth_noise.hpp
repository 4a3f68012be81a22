// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"

namespace roslam {

/// Standard deviation of measured depth: constant + growth * depth². Stereo and structured light measure
/// disparity, whose noise does not depend on the distance (Khoshelham and Oude Elberink, Sensors 2012).
struct ROSLAM_EXPORT DepthNoise {
  double constant = 0.005;  ///< metres
  double growth = 0.004;    ///< 1/metre

  double sigma(double depth) const { return constant + growth * depth * depth; }

  bool operator==(const DepthNoise&) const = default;
};

}  // namespace roslam
