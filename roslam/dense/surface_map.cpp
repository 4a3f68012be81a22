// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/dense/surface_map.hpp"

namespace roslam {

SurfaceMap filter_points(const SurfaceMap& surface, const std::vector<bool>& keep) {
  SurfaceMap result;
  result.spacing = surface.spacing;
  std::vector<std::uint32_t> moved(surface.points.size());
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    if (!keep[i]) continue;
    moved[i] = static_cast<std::uint32_t>(result.points.size());
    result.points.push_back(surface.points[i]);
  }
  for (const auto& t : surface.triangles)
    if (keep[t[0]] && keep[t[1]] && keep[t[2]])
      result.triangles.push_back({moved[t[0]], moved[t[1]], moved[t[2]]});
  return result;
}

std::map<Provenance, std::size_t> count_by_provenance(const SurfaceMap& surface) {
  std::map<Provenance, std::size_t> points;
  for (const SurfacePoint& point : surface.points) ++points[point.provenance];
  return points;
}

SurfaceMap without_inpainted(const SurfaceMap& surface) {
  std::vector<bool> keep;
  for (const SurfacePoint& point : surface.points) keep.push_back(point.provenance != Provenance::kInpainted);
  return filter_points(surface, keep);
}

}  // namespace roslam
