// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "roslam/geometry/se3.hpp"
#include "roslam/map/ids.hpp"

namespace roslam {

/// Where a keyframe is: the world it is in, and its pose there.
struct KeyframePlace {
  WorldId world;
  SE3 T_world_camera;
};

/// Tells where keyframes are by now, all at one moment, in the order they are named in.
using PlacesOf = std::function<std::vector<KeyframePlace>(const std::vector<KeyframeId>&)>;

}  // namespace roslam
