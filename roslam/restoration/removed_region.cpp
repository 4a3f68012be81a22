// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/restoration/removed_region.hpp"

#include <algorithm>

namespace roslam {

cv::Rect square_around(const cv::Rect& box) {
  const int side = std::max(box.width, box.height);
  return {box.x + (box.width - side) / 2, box.y + (box.height - side) / 2, side, side};
}

std::vector<RemovedRegion> regions_of(const std::vector<MovableObject>& objects) {
  std::vector<RemovedRegion> regions;
  regions.reserve(objects.size());
  for (const MovableObject& object : objects) regions.push_back({object.kind, square_around(object.box)});
  return regions;
}

Movable kind_of(const cv::Rect& box, const std::vector<RemovedRegion>& regions) {
  constexpr double kCovered = 0.25;
  const RemovedRegion* best = nullptr;
  int most = 0;
  for (const RemovedRegion& region : regions) {
    const int covered = (box & region.square).area();
    if (covered > most || (best && covered == most && region.square.area() < best->square.area())) {
      most = covered;
      best = &region;
    }
  }
  return best && most > kCovered * box.area() ? best->kind : Movable::kUnknown;
}

}  // namespace roslam
