// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "simulation/simulated_mesh.hpp"
#include "simulation/simulated_noise.hpp"

namespace roslam::simulation {

struct CityPlan;
struct FacadePlan;

/// Where a surface is sampled for its colour.
struct Spot {
  Vector2f uv;      ///< metres on the surface
  Vector3f point;   ///< world frame, metres
  float footprint;  ///< width of a pixel on the surface, metres; finer detail is filtered out
};

/// Procedural textures of the scene, made from noise; deterministic in the seed.
class Painter {
 public:
  Painter(const CityPlan& plan, std::uint32_t seed);

  Vector3f albedo(const Surface& surface, const Spot& spot) const;  ///< red, green, blue in [0, 1]
  Vector3f sky(const Vector3f& direction) const;                    ///< direction of unit length

 private:
  float grain(const Vector2f& uv, float tile, float footprint) const;
  float mottle(const Vector2f& uv, float footprint, std::uint32_t seed) const;
  Vector3f road(const Spot& spot) const;
  float marking(const Vector2f& p, float w) const;
  Vector3f pavement(const Spot& spot) const;
  Vector3f tiles(const Spot& spot) const;
  Vector3f litter(const Vector3f& ground, const Vector2f& p, float w) const;
  Vector3f facade(const Surface& surface, const Spot& spot) const;
  Vector3f wall(const FacadePlan& plan, const Spot& spot, std::uint32_t seed) const;
  Vector3f window(const FacadePlan& plan, const Vector2f& at, const Vector2f& size, float w,
                  std::uint32_t bits) const;
  Vector3f shop(const FacadePlan& plan, const Vector2f& uv, float width, float w, std::uint32_t seed) const;
  Vector3f sign(const Surface& surface, const Spot& spot) const;
  Vector3f car_paint(const Surface& surface, const Spot& spot) const;
  Vector3f cloth(const Surface& surface, const Spot& spot) const;

  const CityPlan& plan_;
  std::uint32_t seed_;
  DetailTexture grain_;
  DetailTexture cracks_;
  DetailTexture leaves_;
};

}  // namespace roslam::simulation
