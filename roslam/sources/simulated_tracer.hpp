// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "roslam/sources/simulated_mesh.hpp"

namespace roslam::simulation {

inline constexpr int kPacket = 8;  ///< rays traced together
inline constexpr std::uint32_t kMiss = 0xffffffffU;

/// Rays side by side, as vector instructions want them. A ray reaches from `near` to `far` lengths of its
/// direction.
struct RayPacket {
  template <typename T>
  using Lanes = std::array<T, kPacket>;
  alignas(32) Lanes<float> ox, oy, oz, dx, dy, dz, near, far;
  alignas(32) Lanes<int> active;  ///< -1 for rays to trace, 0 for the others
};

/// The nearest triangle each ray meets.
struct HitPacket {
  alignas(32) RayPacket::Lanes<float> distance, u, v;    ///< lengths of the direction; barycentric
  alignas(32) RayPacket::Lanes<std::uint32_t> triangle;  ///< kMiss where nothing was met
};

/// Finds what rays meet in a mesh.
class Tracer {
 public:
  Tracer();
  ~Tracer();
  Tracer(const Tracer&) = delete;
  Tracer& operator=(const Tracer&) = delete;

  /// Takes the shape of the mesh in place of the one before. A mesh that changes with every frame is indexed
  /// fast rather than well.
  void build(const Mesh& mesh, bool changes);

  void intersect(const RayPacket& rays, HitPacket& hits) const;

  /// Clears `active` of each ray that meets anything.
  void block(RayPacket& rays) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace roslam::simulation
