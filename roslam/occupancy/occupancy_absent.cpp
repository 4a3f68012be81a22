// SPDX-License-Identifier: BSD-3-Clause
// In place of occupancy_map.cpp in a library without the component dense.
#include "roslam/common/error.hpp"
#include "roslam/occupancy/occupancy_map.hpp"

namespace octomap {
class OcTree {};
}  // namespace octomap

namespace roslam {

namespace {
[[noreturn]] void refuse() {
  throw OptionsError("occupancy: this library was built without the dense map and OctoMap (ROSLAM_DENSE)");
}
}  // namespace

OccupancyMap::OccupancyMap(double) { refuse(); }
OccupancyMap::~OccupancyMap() = default;
OccupancyMap::OccupancyMap(OccupancyMap&&) noexcept = default;
OccupancyMap& OccupancyMap::operator=(OccupancyMap&&) noexcept = default;
void OccupancyMap::add_view(const DepthKeyframe&, const SE3&) { refuse(); }
void OccupancyMap::add_surface(const SurfaceMap&) { refuse(); }
void OccupancyMap::free_from(const OccupancyMap&) { refuse(); }
OccupancyState OccupancyMap::at(const Eigen::Vector3d&) const { refuse(); }
double OccupancyMap::resolution() const { refuse(); }
double OccupancyMap::free_volume() const { refuse(); }
double OccupancyMap::occupied_volume() const { refuse(); }
void OccupancyMap::write(const std::filesystem::path&) const { refuse(); }
OccupancyMap OccupancyMap::read(const std::filesystem::path&) { refuse(); }

double usual_resolution(double spacing) { return spacing; }

}  // namespace roslam
