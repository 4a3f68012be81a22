// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>

namespace roslam::simulation {

/// Random numbers that are the same on every platform for the same seed: the standard fixes the engine but
/// not the distributions, so these are implemented here with exact operations.
class RandomStream {
 public:
  explicit RandomStream(std::uint64_t seed) : engine_(seed) {}

  /// In [low, high).
  double uniform(double low, double high) {
    constexpr double kStep = 1.0 / 9007199254740992.0;  // 2^-53: all bits that a double keeps
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * kStep);
  }

  bool chance(double probability) { return uniform(0.0, 1.0) < probability; }

  /// In 0 to n - 1; n must not be 0.
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(engine_() % n); }

  /// Approximately normal with mean 0 and deviation 1, never beyond 3.5: the sum of four 16-bit numbers.
  double normal() {
    constexpr double kMean = 4 * 32767.5;
    constexpr double kDeviation = 37837.2272;
    const std::uint64_t bits = engine_();
    const std::uint64_t sum =
        (bits & 0xffffU) + (bits >> 16 & 0xffffU) + (bits >> 32 & 0xffffU) + (bits >> 48);
    return (static_cast<double>(sum) - kMean) / kDeviation;
  }

 private:
  std::mt19937_64 engine_;
};

}  // namespace roslam::simulation
