// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "roslam/sources/simulated_mesh.hpp"

namespace roslam::simulation {

/// Where an actor stands on the ground, and how far it has come: wheels and legs turn with the way.
struct Stance {
  Vector3f foot = Vector3f::Zero();
  float yaw = 0.0F;  ///< radians, 0 looks along x
  float way = 0.0F;  ///< metres
};

// Each adds one actor; its looks follow from the seed.
void add_car(MeshBuilder& builder, const Stance& stance, std::uint16_t instance, std::uint32_t seed);
void add_pedestrian(MeshBuilder& builder, const Stance& stance, std::uint16_t instance, std::uint32_t seed);
void add_cyclist(MeshBuilder& builder, const Stance& stance, std::uint16_t instance, std::uint32_t seed);

}  // namespace roslam::simulation
