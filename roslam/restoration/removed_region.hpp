// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/dynamic_objects/movable_object.hpp"

namespace roslam {

/// A region of the auxiliary descriptor (eqs. 12 and 18): class and (l, l) square of a removed object.
struct RemovedRegion {
  Movable kind = Movable::kUnknown;
  cv::Rect square;  ///< pixels; may reach beyond the image
};

/// The square of side l = max(height, width) concentric with a box.
cv::Rect square_around(const cv::Rect& box);

/// Regions of the objects removed from a frame.
std::vector<RemovedRegion> regions_of(const std::vector<MovableObject>& objects);

/// Class of the object removed at a box: that of the region whose square covers most of it (ties: the
/// smallest square); kUnknown if none covers more than a quarter.
Movable kind_of(const cv::Rect& box, const std::vector<RemovedRegion>& regions);

}  // namespace roslam
