// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>

#include "simulation/simulated_mesh.hpp"

namespace roslam::simulation {

/// Share of a pixel of width w centred at x that lies between a and b: antialiases painted shapes.
inline float span(float x, float a, float b, float w) {
  const float scale = 1.0F / w;
  return std::clamp((x - a) * scale + 0.5F, 0.0F, 1.0F) * std::clamp((b - x) * scale + 0.5F, 0.0F, 1.0F);
}

inline Vector3f blend(const Vector3f& a, const Vector3f& b, float t) { return a + t * (b - a); }

inline std::uint32_t index(int i) { return static_cast<std::uint32_t>(i); }

}  // namespace roslam::simulation
