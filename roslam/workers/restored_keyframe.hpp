// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "roslam/common/export.hpp"
#include "roslam/geometry/se3.hpp"
#include "roslam/map/ids.hpp"
#include "roslam/restoration/restored_image.hpp"
#include "roslam/sensors/frame_source.hpp"

namespace roslam {

/// A keyframe without dynamic objects.
struct ROSLAM_EXPORT RestoredKeyframe {
  KeyframeId keyframe;
  Frame frame;         ///< as taken
  SE3 T_world_camera;  ///< as known when it was restored
  SubmapId submap;     ///< that the pose is in
  RestoredImage view;
};

/// Takes a keyframe that was restored, on the thread that restores.
using OnRestored = std::function<void(const RestoredKeyframe&)>;

}  // namespace roslam
