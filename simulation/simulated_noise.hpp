// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace roslam::simulation {

/// Integer hash (Wellons' triple32): the same on every machine, unlike the standard library's distributions.
constexpr std::uint32_t mix(std::uint32_t x) {
  x ^= x >> 17;
  x *= 0xed5ad4bbU;
  x ^= x >> 11;
  x *= 0xac4c1b51U;
  x ^= x >> 15;
  x *= 0x31848babU;
  x ^= x >> 14;
  return x;
}
constexpr std::uint32_t mix(std::uint32_t a, std::uint32_t b) { return mix(a ^ (mix(b) + 0x9e3779b9U)); }
constexpr std::uint32_t mix(std::uint32_t a, std::uint32_t b, std::uint32_t c) { return mix(mix(a, b), c); }

/// A number in [0, 1) from hashed bits.
constexpr float unit(std::uint32_t bits) { return static_cast<float>(bits >> 8) * (1.0F / 16777216.0F); }
constexpr float between(std::uint32_t bits, float low, float high) { return low + (high - low) * unit(bits); }

/// Approximately normal with mean 0 and deviation 1: the sum of the four bytes.
constexpr float normal(std::uint32_t bits) {
  const auto sum = (bits & 255U) + (bits >> 8 & 255U) + (bits >> 16 & 255U) + (bits >> 24);
  return (static_cast<float>(sum) - 510.0F) * (1.0F / 147.8F);
}

/// The largest integer not above x. Compiled for x86-64 without SSE4.1, std::floor is a function call.
constexpr int whole(float x) {
  const int i = static_cast<int>(x);
  return static_cast<float>(i) > x ? i - 1 : i;
}
constexpr float floor(float x) { return static_cast<float>(whole(x)); }

/// Random number stream for the layout of the scene.
class Dice {
 public:
  explicit Dice(std::uint32_t seed) : state_(mix(seed, 0x51ed27U)) {}
  std::uint32_t bits() { return mix(state_ += 0x9e3779b9U); }
  float between(float low, float high) { return simulation::between(bits(), low, high); }
  bool chance(float probability) { return unit(bits()) < probability; }
  std::uint32_t below(std::uint32_t n) { return bits() % n; }

 private:
  std::uint32_t state_;
};

/// Value noise in [0, 1] on a lattice of unit cells.
float value_noise(float x, float y, std::uint32_t seed);

enum class Detail { kGrain, kCracks, kLeaves };

/// A square texture that tiles, kept as a mip map so that detail smaller than a pixel fades to its mean
/// instead of aliasing from frame to frame.
class DetailTexture {
 public:
  DetailTexture(Detail kind, std::uint32_t seed);

  /// About [-1, 1] with mean 0. The tile has period 1; footprint is the width of a pixel in tiles.
  float sample(float u, float v, float footprint) const;

  /// Low frequencies only: a coarse mip level of 32 x 32 texels.
  float soft(float u, float v) const;

 private:
  static constexpr int kLevels = 10;
  float bilinear(int level, float u, float v) const;
  std::array<std::vector<std::int8_t>, kLevels> levels_;
};

}  // namespace roslam::simulation
