// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "simulation/simulated_mesh.hpp"

namespace roslam::simulation {

inline constexpr int kPacket = 8;  ///< rays traced together
inline constexpr std::uint32_t kMiss = 0xffffffffU;

/// Rays as a structure of arrays, for SIMD. A ray reaches from `near` to `far`, in lengths of its direction.
struct RayPacket {
  template <typename T>
  using Lanes = std::array<T, kPacket>;
  alignas(32) Lanes<float> ox, oy, oz, dx, dy, dz, near, far;
  alignas(32) Lanes<int> active;  ///< -1 for rays to trace, 0 for the others
};

/// The nearest triangle that each ray hits.
struct HitPacket {
  alignas(32) RayPacket::Lanes<float> distance, u, v;    ///< lengths of the direction; barycentric
  alignas(32) RayPacket::Lanes<std::uint32_t> triangle;  ///< kMiss where nothing was hit
};

/// Intersects rays with a mesh (Embree).
class Tracer {
 public:
  Tracer();
  ~Tracer();
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  /// Replaces the mesh. For one that `changes` with every frame the BVH is built faster, at lower quality.
  void build(const Mesh& mesh, bool changes);

  void intersect(const RayPacket& rays, HitPacket& hits) const;

  /// Occlusion test: clears `active` of each ray that hits anything.
  void block(RayPacket& rays) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace roslam::simulation
