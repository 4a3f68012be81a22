// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "roslam/common/export.hpp"
#include "roslam/map/ids.hpp"

namespace roslam {

/// A loop that was closed.
struct ROSLAM_EXPORT ClosedLoop {
  KeyframeId keyframe;          ///< the newer keyframe
  KeyframeId matched_keyframe;  ///< the older one that it shows again
  double moved = 0.0;           ///< metres by which the newer keyframe's camera was corrected
  double turned = 0.0;          ///< radians by which it was corrected
  int matches = 0;              ///< inlier landmarks of the geometric verification
  bool merges_submaps = false;  ///< the keyframes were of two submaps, which were merged
};

}  // namespace roslam
