// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "simulation/simulated_mesh.hpp"

namespace roslam::simulation {

/// A corridor of a hospital with one corner to the left: white walls, the same tiles all over the floor, the
/// same doors and lamps again and again, and a few notices. World frame as the city's, z up, metres; the
/// floor is at z = 0 and the centre line runs from (0, 0) along x to the corner, then along y.
struct CorridorPlan {
  float half_width = 1.2F;
  float height = 2.6F;
  float corner = 21.2F;  ///< x of the centre line behind the corner
  float end = 20.0F;     ///< y of the end wall
  float start = -2.0F;   ///< x of the wall behind the start
};

Mesh build_corridor(const CorridorPlan& plan, std::uint32_t seed);

}  // namespace roslam::simulation
