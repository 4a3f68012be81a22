// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "roslam/common/export.hpp"
#include "roslam/dynamic_objects/movable_object.hpp"
#include "roslam/geometry/se3.hpp"

namespace roslam {

/// The movable and moving objects that are removed from a frame.
struct ROSLAM_EXPORT DynamicObjects {
  cv::Mat mask;     ///< CV_8UC1, nonzero where no feature is extracted (eq. 11); empty = nothing is removed
  cv::Mat resting;  ///< CV_8UC1, nonzero on movable objects at rest, a part of mask; empty = none
  cv::Mat still;    ///< likewise, on parts of labelled objects that geometry sees without motion now
  std::vector<MovableObject> objects;   ///< the objects in the mask, not dilated
  bool is_everything_labelled = false;  ///< the newest labels were not used: nearly everything is movable
  int label_age = -1;                   ///< frames since the labelled frame; -1 = none so far
  std::optional<SE3> T_camera_world;    ///< camera pose by optical flow, if it was found
};

/// The pixels of removed objects (CV_8UC1, nonzero there), dilated by a margin (pixels), as outlines are
/// blurred. Empty if nothing was removed.
ROSLAM_EXPORT cv::Mat removed_area(const DynamicObjects& dynamic_objects, const cv::Size& image, int margin);

}  // namespace roslam
