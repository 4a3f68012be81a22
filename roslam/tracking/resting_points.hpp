// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "roslam/geometry/camera.hpp"
#include "roslam/map/map.hpp"
#include "roslam/matching/projection_matcher.hpp"
#include "roslam/tracking/initial_pose.hpp"

namespace roslam {

/// Matches points of a frame with points of keyframes on movable objects at rest, which have depth but no
/// landmark (ObservedFrame::is_movable). used: points of the frame that are matched already. Positions are
/// those that the keyframe measured. Reads the map.
std::vector<TemporaryPoint> match_resting_points(const Map& map, const Camera& camera,
                                                 const std::vector<KeyframeId>& keyframes,
                                                 const ObservedFrame& view, const SE3& T_camera_world,
                                                 const std::vector<std::uint32_t>& used,
                                                 ProjectionMatcher& matcher);

}  // namespace roslam
