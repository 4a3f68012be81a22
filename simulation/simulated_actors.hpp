// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "simulation/simulated_mesh.hpp"

namespace roslam::simulation {

/// Pose of an actor on the ground (world frame, z up) and the distance it has travelled, which sets the angle
/// of its wheels and legs.
struct Stance {
  Vector3f foot = Vector3f::Zero();  ///< on the ground, metres
  float yaw = 0.0F;                  ///< radians about z, 0 faces along x
  float way = 0.0F;                  ///< distance travelled, metres
};

// Each adds one actor whose appearance follows from the seed.
void add_car(MeshBuilder& builder, const Stance& stance, std::uint16_t instance, std::uint32_t seed);
void add_pedestrian(MeshBuilder& builder, const Stance& stance, std::uint16_t instance, std::uint32_t seed);
void add_cyclist(MeshBuilder& builder, const Stance& stance, std::uint16_t instance, std::uint32_t seed);

}  // namespace roslam::simulation
