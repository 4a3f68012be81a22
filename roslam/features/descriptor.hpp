// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "roslam/common/export.hpp"

namespace roslam {

/// A 256-bit ORB descriptor.
using Descriptor = std::array<std::uint64_t, 4>;

constexpr int kDescriptorBits = 256;

/// Number of bits that differ.
ROSLAM_EXPORT int hamming(const Descriptor& a, const Descriptor& b);

/// The nearest and the second nearest of a set of descriptors.
struct ROSLAM_EXPORT NearestTwo {
  int best = -1;    ///< index into the pool, -1 = no candidate
  int second = -1;  ///< index into the pool, -1 = fewer than two candidates
  int best_distance = kDescriptorBits + 1;
  int second_distance = kDescriptorBits + 1;
};

/// Searches only the pool entries named by candidates. Ties go to the candidate named first.
ROSLAM_EXPORT NearestTwo nearest_two(const Descriptor& query, std::span<const Descriptor> pool,
                                     std::span<const std::uint32_t> candidates);

/// Searches the whole pool.
ROSLAM_EXPORT NearestTwo nearest_two(const Descriptor& query, std::span<const Descriptor> pool);

/// Index of the descriptor with the least median distance to all others; the pool must not be empty.
ROSLAM_EXPORT std::size_t most_typical(std::span<const Descriptor> pool);

}  // namespace roslam
