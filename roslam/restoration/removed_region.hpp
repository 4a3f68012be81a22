// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <opencv2/core.hpp>
#include <vector>

#include "roslam/removal/movable_object.hpp"

namespace roslam {

/// A region of the auxiliary descriptor (eqs. 12 and 18): what was removed and the (l, l) square around it.
struct RemovedRegion {
  Movable kind = Movable::kUnknown;
  cv::Rect square;  ///< pixels; may reach beyond the picture
};

/// The square of side l, the larger of height and width, with the centre of a box.
cv::Rect square_around(const cv::Rect& box);

/// Regions of the things removed from a frame.
std::vector<RemovedRegion> regions_of(const std::vector<MovableObject>& objects);

/// What was removed at a box: the class of the region whose square covers most of it, of several that do the
/// smallest; unknown if none covers a quarter.
Movable kind_of(const cv::Rect& box, const std::vector<RemovedRegion>& regions);

}  // namespace roslam
