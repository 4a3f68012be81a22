// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "roslam/geometry/se3.hpp"
#include "roslam/map/ids.hpp"

namespace roslam {

/// Submap of a keyframe and its pose in the world frame of that submap. No submap: the keyframe was
/// withdrawn, as its pose is wrong.
struct KeyframePose {
  SubmapId submap;
  SE3 T_world_camera;
};

/// Returns the current poses of keyframes, in the order of the ids, all from one state of the map.
using PoseLookup = std::function<std::vector<KeyframePose>(const std::vector<KeyframeId>&)>;

}  // namespace roslam
